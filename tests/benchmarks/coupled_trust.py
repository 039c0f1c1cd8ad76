"""What a surrogate's error bound is worth in a coupled run, and how fast such a run is.

The car in two halves runs with a surrogate that has an error bound. The truth is the exact half
under the inputs that the surrogate got in the loop. Between these samples, the road is straight,
and the body moves as the upper half moves it: under a force that is constant over each step.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.couple_here import couple_here
from tests.own_models.halves.cut_car import road, whole

WHOLE = str(Path(__file__).parents[1] / "own_models" / "halves" / "whole_car.py")
CONFIDENCE = 0.95
FINER = 32
"""Parts of a step in which the truth follows its inputs. A force that damps follows their slopes,
which are constant over each part: with 4 parts it was up to 5 N wrong for the car."""

PRACTICAL, PRACTICAL_STEP = 1e-6, 0.005
"""Relative tolerance of scipy, and step of exudyn in s, that are accurate enough for most
purposes: with this step, exudyn errs by 0.09 %."""


def has_bound(fmu: Path) -> bool:
    """Return whether an FMU has an error bound."""
    with unpacked(fmu) as files:
        return "trusted" in files.references


def bound_in_the_loop(
    runs: Sequence[CoupledRun], surrogate: Path, reference: Path
) -> dict[str, float]:
    """Return how often the bound of a car's lower half holds, as means over runs."""
    found = [_bound_in_a_run(run, surrogate, reference) for run in runs]
    return {name: float(np.mean([one[name] for one in found])) for name in found[0]}


def _bound_in_a_run(run: CoupledRun, surrogate: Path, reference: Path) -> dict[str, float]:
    body = CubicHermiteSpline(run.time, run["upper.position"], run["upper.speed"])
    inputs = {"road": (run.time, run["lower.road"]), "body": lambda t: float(body(t))}
    true = truth(reference, inputs, run, "force")
    return replayed(run, "lower", surrogate, tuple(inputs), "force", true)


def truth(reference: Path, inputs: Mapping[str, Any], run: CoupledRun, output: str) -> FloatArray:
    """Return an output of an exact half at the samples of a run, under inputs over time, (N,)."""
    inputs = {f"half.{name}": values for name, values in inputs.items()}
    step, stop = run.figures.step_s / FINER, float(run.time[-1])
    found = couple_here(
        {"half": reference}, [], step=step, stop=stop, inputs=inputs, moving=["half"]
    )
    return found[f"half.{output}"][::FINER]


def replayed(
    run: CoupledRun,
    component: str,
    surrogate: Path,
    names: Sequence[str],
    output: str,
    true: FloatArray,
) -> dict[str, float]:
    """Return how often the bound of a component holds at the samples of a run with its own step.

    The surrogate gets its inputs of the run again, alone.
    """
    inputs = {name: run[f"{component}.{name}"] for name in names}
    with unpacked(surrogate) as files:
        first = {f"initial_{name}": values[0] for name, values in inputs.items()}
        rows = {name: values[1:] for name, values in inputs.items()}
        given = {"inputs_at_step_end": True, "prehistory_known": True, **first}
        wanted = [output, f"{output}_error_bound", "trusted", "error_bound_filled"]
        found = run_fmu(files, rows, wanted, given, run.figures.step_s).values.T
    value, bound, trusted, filled = found
    counts = filled == 1
    error, bound, trusted = np.abs(value - true)[counts], bound[counts], trusted[counts] == 1
    constant = float(np.quantile(error, CONFIDENCE))
    within = error <= bound
    coupled = run[f"{component}.{output}"]
    return {
        "samples": int(counts.sum()),
        "error, relative": float(np.sqrt(np.mean(error**2)) / np.std(true[counts])),
        "replayed and coupled output differ by": float(np.max(np.abs(value - coupled))),
        "share within the bound": float(np.mean(within)),
        "share within the bound, trusted": float(np.mean(within[trusted])),
        "mean bound over the best constant": float(np.mean(bound) / constant),
        "best constant": constant,
        "share trusted": float(np.mean(trusted)),
        "share trusted and beyond the bound": float(np.mean(trusted & ~within)),
    }


def speeds(
    stop: float, mass: float, rides: Mapping[str, Callable[[], Any]], repeats: int
) -> dict[str, float]:
    """Return the speeds of coupled cars, and of the whole car."""
    ways: dict[str, Callable[[], Any]] = {
        f"whole car, scipy, tolerance {tolerance:g}": partial(whole, mass, *road(stop), tolerance)
        for tolerance in (1e-9, PRACTICAL)
    }
    system = load_system(
        Specification(WHOLE, {"mass": mass, "substeps": 1}, PRACTICAL_STEP, "exudyn")
    )
    assert isinstance(system, Stepping)
    heights = np.interp(
        PRACTICAL_STEP * np.arange(1, round(stop / PRACTICAL_STEP) + 1), *road(stop)
    )
    ways[f"whole car, exudyn, step {PRACTICAL_STEP:g} s"] = partial(
        system.simulate, heights[:, None]
    )
    return best_speeds(stop, {**ways, **rides}, repeats)


def best_speeds(
    stop: float, ways: Mapping[str, Callable[[], Any]], repeats: int
) -> dict[str, float]:
    """Return simulated seconds for each second of computing, the best of some runs."""

    def seconds(way: Callable[[], Any]) -> float:
        before = time.process_time()
        way()
        return time.process_time() - before

    return {name: stop / min(seconds(way) for _ in range(repeats)) for name, way in ways.items()}
