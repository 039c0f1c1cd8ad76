"""Beyond the amplitudes that were learnt: a hardening oscillator, by tanh units and by others.

    python tests/benchmarks/extrapolation.py --json -

The Duffing oscillator under forces that are held for random times. Forces of up to 0.5 of the
range are learnt from; errors are those of the newest outputs of every step, as an FMU gives them,
below 0.5 and from 0.5 to 1 of the range, relative to the RMS of the outputs there. Kinds of units
beside each other: eight of ``tanh``, and what ``auto`` chooses, with their number and sub-steps.
What is learnt from has white noise, as records have; errors are beside the truth without noise,
and ``measured`` ones beside records with such noise. Each seed has noise and a training of its
own; medians are over the seeds.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import measure_and_write

from mbs_models.oscillators import DuffingOscillator
from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe
from slide_fmu.systems.simulation import simulate

STEP = 0.005
"""In s: 31 samples of an oscillation at rest."""
SYSTEM = DuffingOscillator(step=STEP, substeps=6)
FORCE = SYSTEM.inputs[0].high
WINDOW = Window(STEP, 400 + 200, 200)
"""2 s truncated: oscillations decay to 3e-4."""
LONGEST_HOLD = 60
"""Samples: 0.3 s, two oscillations."""
LEARNT, BEYOND = (0.02, 0.5), (0.5, 1.0)
"""Amplitudes, as parts of the range."""
FEATURES = FeatureMap(Differences(1))
KINDS: dict[str, dict[str, Any]] = {"tanh": {"hidden": 8}, "auto": {"hidden": "auto"}}
"""Tanh units are eight: beyond the range more of them are worse."""
FAR = (2.0, 4.0, 10.0)
"""Factors on the largest amplitude that was learnt: there the outputs must stay bounded."""


@dataclass(frozen=True, eq=False)
class Records:
    """Forces as parts of the range, (B, N, 1), and scaled positions, (B, N + 1, 1)."""

    forces: FloatArray
    positions: FloatArray

    def noisy(self, decibels: float, seed: int) -> Records:
        """The same with white noise on the positions, so far below their RMS."""
        size = 10 ** (-decibels / 20) * self.positions.std()
        noise = np.random.default_rng(seed).normal(0, size, self.positions.shape)
        return Records(self.forces, self.positions + noise)

    def tensors(self) -> tuple[torch.Tensor, torch.Tensor]:
        """What a fit learns from."""
        features = torch.as_tensor(FEATURES.along(self.forces), dtype=torch.float64)
        return features, torch.as_tensor(self.positions)


def records(seed: int, count: int, samples: int, amplitudes: tuple[float, float]) -> Records:
    """Simulate records whose amplitudes cover a range evenly; positions in m."""
    rng, forces, positions = np.random.default_rng(seed), [], []
    for part in (np.arange(count) + 0.5) / count:
        levels = rng.uniform(-1, 1, samples)
        held = np.repeat(levels, rng.integers(1, LONGEST_HOLD, samples))[:samples]
        amplitude = amplitudes[0] + (amplitudes[1] - amplitudes[0]) * part
        force = amplitude * held / np.abs(held).max()
        forces.append(force[:, None])
        positions.append(simulate(SYSTEM, FORCE * forces[-1]).outputs)
    return Records(np.array(forces), np.array(positions))


def fit(
    data: tuple[Records, Records], units: str, seed: int, progress: Progress
) -> tuple[StateSpace, float]:
    """Fit one seed; the network, and CPU seconds."""
    begin = time.process_time()
    network = StateSpaceRecipe(order=2, units=units, bias=False, **KINDS[units])
    training = LeastSquaresRecipe(
        seed=seed, starts=3, iterations=40, expert=LeastSquaresExpert(part=3, kept=1)
    )
    with tempfile.TemporaryDirectory() as folder:
        parts = (part.tensors() for part in data)
        problem = Problem(WINDOW, FEATURES, *parts, Path(folder) / "fit.pt")
        found = fit_state_space(problem, network, training, progress).network
    return found, time.process_time() - begin


def relative_error(network: StateSpace, test: Records) -> float:
    """RMS error of the newest outputs, relative to the RMS of the outputs."""
    settled = slice(WINDOW.n_in, None)
    truth = test.positions[:, 1:][:, settled]
    error = network.stream(test.forces)[:, settled] - truth
    return float((rms(error) / rms(truth))[0])


def growth(network: StateSpace, test: Records) -> list[float | None]:
    """Largest outputs far beyond the range, over those learnt times the factor; None: no end."""
    largest = np.abs(network.stream(test.forces)).max()
    with np.errstate(over="ignore", invalid="ignore"):
        found = [np.abs(network.stream(f * test.forces)).max() / (f * largest) for f in FAR]
    return [float(value) if np.isfinite(value) else None for value in found]


def errors_of(network: StateSpace, true: list[Records], noisy: list[Records]) -> dict[str, float]:
    """Errors within and beyond what was learnt, beside the truth and beside records."""
    within, beyond = (relative_error(network, test) for test in true)
    measured_within, measured_beyond = (relative_error(network, test) for test in noisy)
    return {
        "error_within": within,
        "error_beyond": beyond,
        "ratio": beyond / within,
        "measured_within": measured_within,
        "measured_beyond": measured_beyond,
        "measured_ratio": measured_beyond / measured_within,
    }


def study(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Fit and test every seed of every kind of units."""
    torch.set_num_threads(1)
    plans = (
        (1, 40, 600, LEARNT),
        (2, 12, 600, LEARNT),
        (3, 20, 1600, LEARNT),
        (4, 20, 1600, BEYOND),
    )
    exact = [records(*plan) for plan in plans]
    scale = exact[0].positions.std()
    exact = [Records(part.forces, part.positions / scale) for part in exact]
    kinds = {}
    for units in KINDS:
        rows = []
        for seed in range(arguments.seeds):
            advance = bar(f"{units}, seed {seed}")
            draws = enumerate(exact, 10 + 100 * seed)
            noisy = [part.noisy(arguments.noise, draw) for draw, part in draws]
            network, seconds = fit((noisy[0], noisy[1]), units, seed, advance)
            cell = network.cell
            kind = {"units": cell.activation, "number": len(cell.w), "substeps": cell.substeps}
            about = {"seed": seed, **kind, "cpu_seconds": seconds}
            far = {"growth_beyond": growth(network, exact[2])}
            rows.append({**about, **errors_of(network, exact[2:], noisy[2:]), **far})
        kinds[units] = {"seeds": rows, **summary(rows)}
    return kinds


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Median, least and largest of the figures of all seeds."""
    names = ("error_within", "error_beyond", "ratio", "measured_ratio")
    found = {name: [row[name] for row in rows] for name in names}
    return {
        name: {"median": float(np.median(v)), "least": min(v), "largest": max(v)}
        for name, v in found.items()
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, choices=range(1, 100), default=3, metavar="N")
    parser.add_argument("--noise", type=float, default=50.0, help="in dB below the outputs")
    measure_and_write(parser, study)


if __name__ == "__main__":
    main()
