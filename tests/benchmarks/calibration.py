"""Physical parameters of a simulated record with noise, found again by ``slide_fmu.calibrate``.

    python tests/benchmarks/calibration.py --folder runs/parameters --json -

The Duffing oscillator of ``parameters.py``, whose surrogate is taken from the same folder, or
trained there. Each of 20 records has unseen values of the parameters, 40 dB of noise on its
output, and begins in the middle of a motion. Counted is how often the 95 % intervals hold the true
values: with white noise, and with noise whose samples follow each other (e[k] = 0.9 e[k-1] + white
noise).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import measure_and_write
from parameters import CASES, RECORDS, error_at, learnt, mean_square_root, recipe_of
from scipy.signal import lfilter

from slide_fmu.apps.calibrate.calibrate import calibrate
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate

COLOURS = {"white": 0.0, "coloured": 0.9}
COUNT, DURATION, SEED = 20, 36.0, 20280001
OWN = 4
"""The surrogate's own error is measured at so many other values."""


def record_of(recipe: Recipe, values: Mapping[str, float], index: int) -> tuple[FloatArray, ...]:
    """Simulate a record of some values, and cut off the burn-in: the rest begins in motion."""
    fixed = recipe.at(values)
    system, stream = case_of(fixed).system, Stream(TEST, SEED, (1.0, 1.0), DURATION)
    drawn = draw(fixed, system, stream, index)
    begin = round(recipe.data.burn_in / recipe.window.step)
    outputs = simulate(system, drawn.inputs, drawn.initial).outputs[1:]
    return drawn.inputs[begin:], outputs[begin:]


def noise_of(outputs: FloatArray, decibels: float, colour: float, seed: int) -> FloatArray:
    """Draw noise that is so many decibels below the standard deviation of the outputs."""
    white = np.random.default_rng([SEED, seed]).normal(size=outputs.shape)
    added = lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], white, axis=0)
    return np.asarray(added * outputs.std(axis=0) * 10 ** (-decibels / 20))


def calibrated(
    surrogate: Surrogate,
    record: tuple[FloatArray, ...],
    true: Mapping[str, float],
    own_error: float,
) -> dict[str, Any]:
    """Calibrate to a record, and say how far each value is off and whether its interval holds."""
    begin = time.process_time()
    found = calibrate(surrogate, *record, own_error=[own_error])
    seconds = time.process_time() - begin
    rows = {}
    for fitted in found.parameters:
        value = true[fitted.parameter.name]
        rows[fitted.parameter.name] = {
            "true": value,
            "error": fitted.value / value - 1,
            "half_width": 0.5 * (fitted.high - fitted.low) / value,
            "holds": fitted.low <= value <= fitted.high,
        }
    return {"parameters": rows, "cpu_seconds": seconds, "remarks": list(found.remarks)}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Count how often intervals hold the true values, and how wide they are."""
    found: dict[str, Any] = {"cpu_seconds_each": float(np.mean([r["cpu_seconds"] for r in rows]))}
    for name in rows[0]["parameters"]:
        of_name = [row["parameters"][name] for row in rows]
        found[name] = {
            "held": sum(row["holds"] for row in of_name),
            "of": len(of_name),
            "relative_rms_error": mean_square_root([row["error"] for row in of_name]),
            "mean_relative_half_width": float(np.mean([row["half_width"] for row in of_name])),
        }
    return found


def measure(case: str, arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Calibrate one case to all records."""
    recipe, count = recipe_of(case, arguments.quick), 2 if arguments.quick else COUNT
    surrogate, _ = learnt(recipe, arguments.folder / case / "parameters", bar)
    stream = Stream(TEST, SEED, (1.0, 1.0), DURATION)
    points = [drawn_parameters(recipe, stream, index) for index in range(count + OWN)]
    errors = [
        error_at(surrogate, recipe, p, 2000 + RECORDS * i, arguments.quick)
        for i, p in enumerate(points[count:])
    ]
    own_error, progress = mean_square_root(errors), bar("calibrations")
    found: dict[str, Any] = {"own_relative_error": own_error, "decibels": arguments.decibels}
    kinds: dict[str, list[dict[str, Any]]] = {"clean": [], **{name: [] for name in COLOURS}}
    for index, true in enumerate(points[:count]):
        inputs, clean = record_of(recipe, true, index)
        kinds["clean"].append(calibrated(surrogate, (inputs, clean), true, own_error))
        for name, colour in COLOURS.items():
            noisy = clean + noise_of(clean, arguments.decibels, colour, index)
            kinds[name].append(calibrated(surrogate, (inputs, noisy), true, own_error))
        progress(index + 1, count)
    for name, rows in kinds.items():
        found[name] = {**summary(rows), "records": rows}
    return found


def study(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Calibrate all cases that are asked for."""
    torch.set_num_threads(1)
    return {case: measure(case, arguments, bar) for case in arguments.case}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", nargs="+", choices=list(CASES), default=["mass_16"])
    parser.add_argument("--folder", type=Path, default=Path("runs/parameters"))
    parser.add_argument("--decibels", type=float, default=40.0, help="noise below the output")
    parser.add_argument("--quick", action="store_true", help="small sizes, which show nothing")
    measure_and_write(parser, study)


if __name__ == "__main__":
    main()
