"""What it is worth to know the spectrum of the noise in a record.

    python tests/benchmarks/coloured_noise.py --json -

A mass on a hardening spring (x'' + 3.6 x' + 9 x + 4 x^3 = u) is measured with noise in each
output, relative to its deviation. The same network is learnt from the record alone, and with a
second record of the noise, which was taken while nothing moved. The truth is known, so the errors
are those beside it, about their means: nothing tells the offset of a slow drift from that of a
network.

The cases:

- ``drift``: the position with a drift of 10 % that lasts for a hundred samples.
- ``hum``: the position with a hum of 10 % at an eighth of the sample rate.
- ``slow_hum``: a hum at the machine's own frequency.
- ``two``: the position with a drift of 10 %, the speed with white noise of 0.2 %.
- ``white``: the position with white noise of 5 %, where there is nothing to gain.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.signal
import torch
from figures_out import measure_and_write

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe

STEP, PARTS = 0.03, 10
"""Sample step in s, and steps of the solver in it."""
WINDOW = Window(STEP, 200, 40)
FORCE = 3.0
"""Deviation of the force."""
SAMPLES, AT_REST, TESTED = 6000, 4000, 4000
"""Samples that are learnt from, of the noise record, and that are tested."""
FEATURES = FeatureMap(Differences(1))
NETWORK = StateSpaceRecipe(order=2, hidden=4, units="mixed")
TRAINING = LeastSquaresRecipe(
    starts=3,
    iterations=20,
    expert=LeastSquaresExpert(start_iterations=8, kept=1, kept_iterations=10),
)


class Noise(NamedTuple):
    """Noise of an output: its size beside the output's deviation, and its denominator in z^-1."""

    size: float
    poles: tuple[complex, ...] = ()

    def draw(self, samples: int, rng: np.random.Generator) -> FloatArray:
        """Draw noise, (samples,), whose start has decayed; a fiftieth of its power is white."""
        white = rng.normal(size=samples + 4000)
        coloured = scipy.signal.lfilter([1.0], np.poly(self.poles).real, white)[4000:]
        own = coloured / coloured.std()
        mixed = np.sqrt(0.98) * own + np.sqrt(0.02) * rng.normal(size=samples)
        return np.asarray(self.size * (mixed if len(self.poles) > 1 else own))


def hum(angle: float) -> Noise:
    """A hum of an angle in rad in each sample, which keeps its phase for some 500 samples."""
    pole = complex(0.998 * np.exp(1j * angle))
    return Noise(0.1, (pole, pole.conjugate()))


DRIFT = Noise(0.1, (0.99,))
CASES: dict[str, tuple[Noise, ...]] = {
    "drift": (DRIFT,),
    "hum": (hum(np.pi / 4),),
    "slow_hum": (hum(3.0 * STEP),),
    "two": (DRIFT, Noise(0.002)),
    "white": (Noise(0.05),),
}


def simulate(force: FloatArray) -> FloatArray:
    """Return position and speed, (N + 1, 2), from rest under a force (N,) that moves linearly."""
    x, v, h = 0.0, 0.0, STEP / PARTS
    found, before = np.zeros((len(force) + 1, 2)), force[0]
    for k, now in enumerate(force):
        for part in range(PARTS):
            u = before + (now - before) * (part + 0.5) / PARTS
            v += h * (u - 3.6 * v - 9.0 * x - 4.0 * x**3)
            x += h * v
        found[k + 1], before = (x, v), now
    return found


def motion(samples: int, seed: int, n_outputs: int) -> tuple[FloatArray, FloatArray]:
    """Return scaled forces (1, N, 1), and the first outputs without noise, (N + 1, n_outputs)."""
    white = np.random.default_rng(seed).normal(size=samples)
    force = scipy.signal.lfilter(*scipy.signal.butter(2, 0.15), white)
    force /= force.std()
    return force[None, :, None], simulate(FORCE * force)[:, :n_outputs]


def errors_of(noises: tuple[Noise, ...], seed: int, known: bool) -> tuple[list[float], float]:
    """Learn a network; return its errors beside the truth, relative, and the CPU time in s."""
    rng, count = np.random.default_rng(1000 + seed), len(noises)
    motions = [motion(n, 10 * seed + k, count) for k, n in enumerate((SAMPLES, SAMPLES // 4))]
    scale = motions[0][1].std(axis=0)

    def noise(samples: int) -> FloatArray:
        return np.stack([noise.draw(samples, rng) for noise in noises], 1)

    def measured(u: FloatArray, y: FloatArray) -> tuple[torch.Tensor, torch.Tensor]:
        outputs = torch.from_numpy(y / scale + noise(len(y)))
        return torch.from_numpy(FEATURES.along(u)).double(), outputs[None]

    parts = [measured(*pair) for pair in motions]
    at_rest = (noise(AT_REST),) if known else None
    training = TRAINING.model_copy(update={"seed": seed})
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        problem = Problem(WINDOW, FEATURES, *parts, Path(folder) / "fit.pt", noise=at_rest)
        network = fit_state_space(problem, NETWORK, training, lambda *_: None).network
    spent = time.process_time() - begin
    inputs, truth = motion(TESTED, 10 * seed + 5, count)
    left = (network.stream(inputs)[0] - truth[1:] / scale)[2 * WINDOW.n_in :]
    return (left.std(axis=0) / (truth / scale).std(axis=0)).tolist(), spent


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Learn all cases with all seeds, without the noise record and with it."""
    torch.set_num_threads(1)
    figures: dict[str, Any] = {}
    runs = [(case, seed) for case in arguments.cases for seed in range(arguments.seeds)]
    show = bar("cases")
    for done, (case, seed) in enumerate(runs):
        show(done, len(runs))
        found = figures.setdefault(case, {"without": [], "with": [], "cpu_s": []})
        for name, known in (("without", False), ("with", True)):
            errors, spent = errors_of(CASES[case], seed, known)
            found[name].append(errors)
            found["cpu_s"].append(spent)
    show(len(runs), len(runs))
    return figures


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--seeds", type=int, default=3, help="number of records and trainings")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
