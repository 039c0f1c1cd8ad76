"""What an FMU of held inputs is worth where they jump at any time, and where they are smooth.

    python tests/benchmarks/held_anytime.py fmus/duffing_10ms/duffing_10ms.fmu --json -

Steps come every 1 to 4 s, anywhere between communication points; smooth inputs are sums of five
tones in 1 to 3 Hz, up to half of the range. The truth is the reference at a twentieth of the
FMU's step. The plain call is measured at the FMU's own step, at a quarter and at a twentieth of
it, where a communication point falls on each step. Known inputs are the means over the FMU's own
steps, with ``inputs_held`` = 1. Silent are samples that are trusted with an error of more than
twice the bound.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import HELD_ANYTIME

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.calls import CallAnswers, MeasuredMotion, answers
from slide_fmu.validation.input_courses import InputCourse, Stairs

FINE = 20
"""Parts of an own step over which the reference holds its inputs."""
SECONDS, BURN_IN = 60.0, 10.0
APART = (1.0, 4.0)
"""Distances between steps in s."""
HZ, TONES, PART = (1.0, 3.0), 5, 0.5
"""Frequencies of smooth inputs, how many they are, and the part of half the range they reach."""


def ends(surrogate: Surrogate) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the ranges of the inputs, (n_inputs,) each."""
    low, high = (np.array([getattr(s, end) for s in surrogate.inputs]) for end in ("low", "high"))
    return low, high


def steps(surrogate: Surrogate, fine: float, rng: np.random.Generator) -> Stairs:
    """Return levels that are held for a while; they change at multiples of the fine step."""
    count = round(SECONDS / fine)
    lengths = (rng.uniform(*APART, count) / fine).astype(int)
    levels = rng.uniform(*ends(surrogate), (len(lengths), len(surrogate.inputs)))
    return Stairs(fine, np.repeat(levels, lengths, axis=0)[:count])


class Smooth:
    """Sums of tones, up to a part of half the range about its middle."""

    def __init__(self, surrogate: Surrogate, rng: np.random.Generator) -> None:
        shape = TONES, len(surrogate.inputs)
        low, high = ends(surrogate)
        self._middle = 0.5 * (low + high)
        self._size = 0.5 * PART * (high - low) / TONES
        self._hz, self._phase = rng.uniform(*HZ, shape), rng.uniform(0.0, 2 * np.pi, shape)

    def __call__(self, times: FloatArray) -> FloatArray:
        turned = 2 * np.pi * self._hz * times[:, None, None] + self._phase
        return np.asarray(self._middle + self._size * np.sin(turned).sum(axis=1))


def figures_of(found: CallAnswers) -> dict[str, float]:
    """Return error, covered, trusted and silent, of the worst output."""
    assert found.bounds is not None
    assert found.trusted is not None
    size = found.truth.std(axis=0)
    error, bounds = np.abs(found.error)[found.filled], found.bounds[found.filled]
    trusted = found.trusted[found.filled]
    return {
        "relative_rmse": float(np.max(np.sqrt(np.mean(error**2, axis=0)) / size)),
        "covered": float(np.min(np.mean(error <= bounds, axis=0))),
        "trusted": float(np.mean(trusted)),
        "silent": float(np.mean(trusted & (error > 2 * bounds).any(axis=1))),
    }


def rows_of_fmu(fmu: Path, bar: Stages) -> list[dict[str, Any]]:
    """Measure one FMU whose inputs are held, and that has an error bound."""
    surrogate, provenance = read_fmu(fmu)
    case = case_of(recipe_of_provenance(provenance, str(fmu)))
    own, progress, found = surrogate.window.step, bar(surrogate.name), list[dict[str, Any]]()
    fine, rng = own / FINE, np.random.default_rng(HELD_ANYTIME)
    reference = case.system_with_step(fine)
    middles = fine * (np.arange(round(SECONDS / own) * FINE) + 0.5)
    courses: dict[str, InputCourse] = {
        "steps": steps(surrogate, fine, rng),
        "smooth": Smooth(surrogate, rng),
    }
    with unpacked(fmu) as files:
        for number, (name, course) in enumerate(courses.items()):
            progress(number, len(courses))
            rows = course(middles)
            truth = simulate(reference, rows).outputs
            means = rows.reshape(-1, FINE, rows.shape[1]).mean(axis=1)
            plain, known = (
                MeasuredMotion(one, truth, fine, BURN_IN) for one in (course, Stairs(own, means))
            )
            for part in (1, 4, FINE):
                at = answers(
                    files, surrogate.inputs, surrogate.outputs, plain, "plain", own / part
                )
                found.append(
                    {"inputs": name, "call": "plain", "step_s": own / part, **figures_of(at)}
                )
            at = answers(files, surrogate.inputs, surrogate.outputs, known, "known", own)
            found.append({"inputs": name, "call": "known", "step_s": own, **figures_of(at)})
    progress(len(courses), len(courses))
    return found


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all FMUs."""
    return {fmu.stem: rows_of_fmu(fmu, bar) for fmu in arguments.fmus}


def main() -> None:
    """Measure the FMUs that the command line names."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n", maxsplit=1)[0])
    parser.add_argument("fmus", nargs="+", type=Path)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
