"""Coupled runs of a quarter car that was cut in two, by method and step.

Both halves are FMUs that integrate their exact equations; the whole car, integrated by scipy with
a tolerance of 1e-9, is the truth. Errors are RMS errors of the position of the body, relative to
its RMS about the mean. The energy that a coupling adds is the work on the body less the work of
the lower half, as a part of the energy that passed between them.

    PYTHONPATH=. python tests/benchmarks/coupled.py --json -

A surrogate may take the place of the lower half. Its recipe needs about five CPU-minutes, and
18 with an error bound; then the share of samples is printed at which the bound holds in the loop:

    slide-fmu run tests/own_models/halves/lower_half_bounded.toml
    PYTHONPATH=. python tests/benchmarks/coupled.py \\
        --surrogate runs/lower_half_bounded/lower_half_bounded.fmu
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError
from tests.benchmarks.coupled_trust import bound_in_the_loop, has_bound, speeds
from tests.benchmarks.figures_out import measure_and_write
from tests.couple_here import couple_here
from tests.own_models.halves.cut_car import LINKS, relative_error, road, whole, write_halves

METHODS = {
    "jacobi, zero": {"method": "jacobi", "extrapolation": "zero"},
    "jacobi, linear": {"method": "jacobi", "extrapolation": "linear"},
    "gauss_seidel, zero": {"method": "gauss_seidel", "extrapolation": "zero"},
    "gauss_seidel, linear": {"method": "gauss_seidel", "extrapolation": "linear"},
    "fixed_point": {"method": "fixed_point"},
    "newton": {"method": "newton"},
}
STEPS = (0.01, 0.02)
"""Communication steps in s."""

OFFSET, FREE_STEPS, REST = 0.01, 80, 4.0
"""Without a road, the body starts with this offset in m, and must come to rest within this number
of steps, and at least this time in s."""

FIRST, FACTOR, TIMES = 0.002, 2**0.25, (1, 2, 5, 10, 20, 40)
"""Explicit steps grow from the first one in s by this factor; implicit ones are tried at these
multiples of the longest stable explicit step."""

ROADS = (11, 12, 13, 14)
"""Seeds of the roads over which bounds are measured: one road says little of a bound."""

REPEATS = 3


def ride(
    halves: Mapping[str, Path], mass: float, step: float, stop: float, seed: int = 1, **how: Any
) -> CoupledRun:
    """Run the car over a road; a surrogate says itself what its inputs do."""
    exact = halves["lower"].name == "lower.fmu"
    return couple_here(
        halves,
        LINKS,
        step=step,
        stop=stop,
        inputs={"lower.road": road(stop, seed)},
        parameters={"upper.mass": mass},
        moving=["lower"] if exact else [],
        **how,
    )


def accuracy(
    halves: Mapping[str, Path], mass: float, step: float, truth: FloatArray, stop: float, how: Any
) -> dict[str, Any]:
    """Return the error of a ride, the energy that was added, and what it took."""
    times = road(stop)[0]
    try:
        run = ride(halves, mass, step, stop, **how)
    except CoSimulationError:  # a half refuses where the motion has grown without bound
        return {"grows": True}
    found = np.interp(times, run.time, run["upper.position"])
    energy = {}
    if "lower.work" in run.values:
        added = run["upper.work"][-1] - run["lower.work"][-1]
        energy = {"energy added": float(added / run["lower.exchanged"][-1])}
    figures = run.figures
    return {
        "grows": False,
        "error": relative_error(found, truth),
        "force_rms_N": float(np.std(run["lower.force"])),
        **energy,
        "iterations": figures.iterations,
        "most iterations": figures.most_iterations,
        "steps of the lower half": figures.component_steps["lower"] / figures.steps,
    }


def rides(
    halves: Mapping[str, Path], mass: float, truth: FloatArray, stop: float
) -> dict[str, Any]:
    """Return the accuracy of all methods at all steps."""
    return {
        f"{1e3 * step:g} ms": {
            name: accuracy(halves, mass, step, truth, stop, how) for name, how in METHODS.items()
        }
        for step in STEPS
    }


def is_stable(halves: Mapping[str, Path], mass: float, step: float, how: Any) -> bool:
    """Return whether a body with an offset comes to rest on a flat road."""
    count = max(FREE_STEPS, math.ceil(REST / step))
    try:
        run = couple_here(
            halves,
            LINKS,
            step=step,
            stop=count * step,
            inputs={"lower.road": 0.0},
            parameters={"upper.mass": mass, "upper.start": OFFSET},
            moving=["lower"],
            **how,
        )
    except CoSimulationError:
        return False
    last = np.abs(run["upper.position"][-count // 4 :])
    return bool(last.max() < 0.5 * OFFSET)


def longest_stable(halves: Mapping[str, Path], mass: float, how: Any) -> float:
    """Return the longest step in s from which an explicit method does not grow."""
    step = FIRST
    while is_stable(halves, mass, step * FACTOR, how):
        step *= FACTOR
    return step


def stability(halves: Mapping[str, Path], mass: float) -> dict[str, Any]:
    """Return longest stable steps of explicit methods in s, and how far implicit ones go."""
    explicit = {
        name: longest_stable(halves, mass, how)
        for name, how in METHODS.items()
        if how["method"] in ("jacobi", "gauss_seidel")
    }
    best = max(explicit.values())
    stable = [n for n in TIMES if is_stable(halves, mass, n * best, METHODS["newton"])]
    return {
        "explicit_s": explicit,
        "newton, stable at these multiples of the best explicit step": stable,
    }


def cost(halves: Mapping[str, Path]) -> dict[str, float]:
    """Return CPU times of a step in s, each the shortest of some runs, without their begin."""

    def cpu_time(stop: float, how: Any) -> float:
        before = time.process_time()
        ride(halves, 300.0, 0.01, stop, **how)
        return time.process_time() - before

    times = {
        name: (
            min(cpu_time(4.0, how) for _ in range(REPEATS))
            - min(cpu_time(0.04, how) for _ in range(REPEATS))
        )
        / 396
        for name, how in METHODS.items()
    }
    return {**times, "newton over jacobi": times["newton"] / times["jacobi, linear"]}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all figures."""
    found: dict[str, Any] = {"duration_s": arguments.stop, "bodies": {}}
    progress = bar("coupled")
    with tempfile.TemporaryDirectory() as folder:
        halves = write_halves(Path(folder))
        exact = halves["lower"]
        if arguments.surrogate is not None:
            halves["lower"] = arguments.surrogate
        for number, mass in enumerate(arguments.masses):
            progress(number, len(arguments.masses))
            truth = whole(mass, *road(arguments.stop))
            if arguments.surrogate is not None:
                of_body = rides(halves, mass, truth, arguments.stop)
                if has_bound(arguments.surrogate):
                    short = arguments.stop / len(ROADS)
                    runs = [ride(halves, mass, STEPS[0], short, seed) for seed in ROADS]
                    of_body["bound"] = bound_in_the_loop(runs, arguments.surrogate, exact)
                found["bodies"][f"{mass:g} kg"] = of_body
                continue
            found["bodies"][f"{mass:g} kg"] = {
                **rides(halves, mass, truth, arguments.stop),
                "stable steps": stability(halves, mass),
            }
        found["seconds of a step"] = cost(halves)
        ways = {
            f"newton, {1e3 * step:g} ms": partial(ride, halves, 300.0, step, arguments.stop)
            for step in STEPS
        }
        found["simulated seconds in a second"] = speeds(arguments.stop, 300.0, ways, REPEATS)
        progress(len(arguments.masses), len(arguments.masses))
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stop", type=float, default=60.0, help="duration of a ride in s")
    parser.add_argument("--surrogate", type=Path, help="FMU in the place of the lower half")
    parser.add_argument("--masses", type=float, nargs="+", default=[300.0, 25.0, 12.0])
    measure_and_write(parser, measure)
