"""What a surrogate's error bound is worth in a coupled run, and how fast such a run is.

The car in two halves runs with a surrogate that has an error bound. The truth is the exact half
under the inputs that the surrogate got in the loop. Between these samples, the road is straight,
and the body moves as the upper half moves it: under a force that is constant over each step.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from slide_fmu.apps.couple.couple import couple
from slide_fmu.apps.couple.result import Coupled
from slide_fmu.cosim.run import run_fmu, unpacked
from tests.own_models.halves.cut_car import road, whole

CONFIDENCE = 0.95
FLAGS = ["force", "force_error_bound", "trusted", "error_bound_filled"]
FINER = 4
"""Parts of a step in which the truth follows the motion of the body."""

PRACTICAL = 1e-6
"""Relative tolerance of an integration that is accurate enough for most purposes."""


def has_bound(fmu: Path) -> bool:
    """Return whether an FMU has an error bound."""
    with unpacked(fmu) as files:
        return "trusted" in files.references


def bound_in_the_loop(run: Coupled, surrogate: Path, reference: Path) -> dict[str, float]:
    """Return how often the bound holds at the samples of a run with the surrogate's own step."""
    inputs = {name: run[f"lower.{name}"] for name in ("road", "body")}
    step = run.figures.step_s
    with unpacked(surrogate) as files:
        first = {f"initial_{name}": values[0] for name, values in inputs.items()}
        rows = {name: values[1:] for name, values in inputs.items()}
        given = {"inputs_at_step_end": True, "prehistory_known": True, **first}
        force, bound, trusted, filled = run_fmu(files, rows, FLAGS, given, step).values.T
    body = CubicHermiteSpline(run.time, run["upper.position"], run["upper.speed"])
    true = couple(
        {"lower": reference},
        [],
        step=step / FINER,
        stop=run.time[-1],
        inputs={"lower.road": (run.time, inputs["road"]), "lower.body": lambda t: float(body(t))},
        moving=["lower"],
    )["lower.force"][::FINER]
    counts = filled == 1
    error, bound, trusted = np.abs(force - true)[counts], bound[counts], trusted[counts] == 1
    constant = float(np.quantile(error, CONFIDENCE))
    within = error <= bound
    return {
        "samples": int(counts.sum()),
        "error of the force, relative": float(np.sqrt(np.mean(error**2)) / np.std(true[counts])),
        "replayed and coupled force differ by": float(np.max(np.abs(force - run["lower.force"]))),
        "share within the bound": float(np.mean(within)),
        "share within the bound, trusted": float(np.mean(within[trusted])),
        "mean bound over the best constant": float(np.mean(bound) / constant),
        "best constant, N": constant,
        "share trusted": float(np.mean(trusted)),
        "share trusted and beyond the bound": float(np.mean(trusted & ~within)),
    }


def speeds(
    stop: float, mass: float, rides: Mapping[str, Callable[[], Any]], repeats: int
) -> dict[str, float]:
    """Return simulated seconds for each second of computing, the best of some runs."""
    ways = {
        f"whole car, tolerance {tolerance:g}": partial(whole, mass, *road(stop), tolerance)
        for tolerance in (1e-9, PRACTICAL)
    }

    def seconds(way: Callable[[], Any]) -> float:
        before = time.process_time()
        way()
        return time.process_time() - before

    return {
        name: stop / min(seconds(way) for _ in range(repeats))
        for name, way in {**ways, **rides}.items()
    }
