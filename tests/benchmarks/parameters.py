"""Physical parameters in a surrogate, beside surrogates trained for fixed values.

    python tests/benchmarks/parameters.py --folder runs/parameters --json -

The Duffing oscillator under a force that is drawn anew for every sample, with a mass of 1 to 3 kg
and a damping of 16 or 8 N s/m, or with mass and stiffness. One surrogate follows the parameters;
others are trained for fixed values, with the same data in all. A part of the data is beyond the
range, since rare records reach further than all that was learnt from. Errors are relative RMSE
about the mean, sample by sample, on records that no training saw: at 20 unseen values, with four
records each, and at the corners. Each surrogate for a fixed value is measured on the inputs of all
of these records: so the worst of 20 stands beside the mean of four worst of 20. What is done is
kept in the folder, and not done again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import measure_and_write

from slide_fmu.core.measures import rms
from slide_fmu.core.parameters import corners_of
from slide_fmu.core.progress import Stages
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.data.generation import generate
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.fitting.fit import fit_surrogate
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import recipe_system
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate

MASS = {"range": [1.0, 3.0], "unit": "kg", "transform": "reciprocal"}
STIFFNESS = {"range": [1000.0, 2500.0], "unit": "N/m", "transform": "log"}
CASES: dict[str, dict[str, Any]] = {
    "mass_16": {"damping": 16.0, "truncated": 174, "parameters": {"mass": MASS}, "train": 100},
    "mass_8": {"damping": 8.0, "truncated": 400, "parameters": {"mass": MASS}, "train": 100},
    "two": {
        "damping": 16.0,
        "truncated": 174,
        "parameters": {"mass": MASS, "stiffness": STIFFNESS},
        "train": 200,
    },
}
FIXED = {"mass_16": (1.0, 1.5, 2.0, 3.0), "mass_8": (1.0, 1.5, 2.0, 3.0), "two": ()}
"""Values of the mass for which surrogates of their own are trained."""
BEYOND = 12
"""One of so many trajectories is beyond the range of the inputs."""
N_OUT, STEP, DURATION = 60, 0.03, 30.0
UNSEEN, RECORDS, SEED = 20, 4, 20270001


def recipe_of(case: str, quick: bool) -> Recipe:
    """Return the recipe of a case; a quick one only shows that the benchmark works."""
    found = CASES[case]
    tables = {
        "name": case,
        "description": "Duffing oscillator",
        "system": {
            "model": "mbs_models.oscillators:DuffingOscillator",
            "parameters": {"substeps": 12, "damping": found["damping"]},
        },
        "parameters": found["parameters"],
        "window": {"step": STEP, "n_in": found["truncated"] + N_OUT, "n_out": N_OUT},
        "data": {
            "seed": 1,
            "duration": 20.0,
            "burn_in": found["truncated"] * STEP,
            "train": 7 if quick else found["train"] - found["train"] // BEYOND,
            "beyond": 1 if quick else found["train"] // BEYOND,
            "validation": 4 if quick else 32,
            "excitation": [{"kind": "held_random", "weight": 1.0}],
        },
        "network": {"order": 2, "hidden": 4 if quick else 32},
        "training": {
            "part": 3,
            "starts": 3,
            "kept": 2,
            "kept_iterations": 25,
            **({"starts": 1, "iterations": 3} if quick else {}),
        },
    }
    return Recipe.model_validate(tables)


def fixed_recipe(recipe: Recipe, mass: float, parts: int) -> Recipe:
    """Return the recipe for one mass, with its part of the trajectories."""
    data = recipe.data
    counts = {"train": data.train // parts, "beyond": data.beyond // parts}
    part = data.model_copy(update={name: max(1, count) for name, count in counts.items()})
    return recipe.at({"mass": mass}).model_copy(update={"data": part})


def learnt(recipe: Recipe, folder: Path, bar: Stages) -> tuple[Surrogate, float]:
    """Return the surrogate of a recipe, and the CPU time in s of its training; made once."""
    place, seconds = folder / "surrogate.slide", folder / "seconds.json"
    if not place.exists():
        folder.mkdir(parents=True, exist_ok=True)
        store = folder / "data.zarr"
        with ThreadPoolExecutor(1) as pool:
            generate(recipe, store, pool, bar("trajectories"))
        begin = time.process_time()
        fit = fit_surrogate(recipe, recipe_system(recipe), store, folder / "states", bar)
        seconds.write_text(json.dumps(time.process_time() - begin), encoding="utf-8")
        fit.surrogate.save(place)
    return Surrogate.from_bytes(place.read_bytes()), json.loads(seconds.read_text("utf-8"))


def error_at(
    surrogate: Surrogate, recipe: Recipe, values: Mapping[str, float], first: int, quick: bool
) -> float:
    """Return the relative RMSE with some values, on records of their own from a first one on."""
    fixed = recipe.at(values)
    system, stream = recipe_system(fixed), Stream(TEST, SEED, (1.0, 1.0), DURATION)
    settled = surrogate.window.n_in
    misses, references = [], []
    for index in range(first, first + (1 if quick else RECORDS)):
        drawn = draw(fixed, system, stream, index)
        reference = simulate(system, drawn.inputs, drawn.initial).outputs[1:]
        own = values if surrogate.parameters else None
        found = surrogate.predict_newest(drawn.inputs, own)
        misses.append((found - reference)[settled:])
        references.append(reference[settled:])
    whole = np.concatenate(references)
    return float((rms(np.concatenate(misses)) / rms(whole - whole.mean(axis=0)))[0])


def mean_square_root(errors: Sequence[float]) -> float:
    """Return the root of the mean square of errors."""
    return float(np.sqrt(np.mean(np.square(errors))))


def measure(case: str, arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Learn and measure one case."""
    quick, folder = arguments.quick, arguments.folder / case
    recipe = recipe_of(case, quick)
    surrogate, seconds = learnt(recipe, folder / "parameters", bar)
    stream = Stream(TEST, SEED, (1.0, 1.0), DURATION)
    points = [drawn_parameters(recipe, stream, i) for i in range(2 if quick else UNSEEN)]
    unseen = [error_at(surrogate, recipe, p, RECORDS * i, quick) for i, p in enumerate(points)]
    corners = corners_of(recipe.physical())
    at_corners = [error_at(surrogate, recipe, corner, 1000, quick) for corner in corners]
    found: dict[str, Any] = {
        "rms": mean_square_root(unseen),
        "worst": max(unseen),
        "unseen": [{**p, "error": error} for p, error in zip(points, unseen, strict=True)],
        "corners": [{**c, "error": error} for c, error in zip(corners, at_corners, strict=True)],
        "parameters": surrogate.network.count_parameters(),
        "cpu_seconds": seconds,
        "fixed": [],
    }
    masses = FIXED[case][:1] if quick else FIXED[case]
    for mass in masses:
        own = fixed_recipe(recipe, mass, len(FIXED[case]))
        alone, seconds = learnt(own, folder / f"mass_{mass:g}".replace(".", "_"), bar)
        errors = [
            error_at(alone, own, {"mass": mass}, RECORDS * index, quick)
            for index in range(len(points))
        ]
        row = {"mass": mass, "rms": mean_square_root(errors), "worst": max(errors)}
        found["fixed"].append({**row, "errors": errors, "cpu_seconds": seconds})
    if masses:
        squares = mean_square_root([row["rms"] for row in found["fixed"]])
        found["rms_over_fixed"] = found["rms"] / squares
        worst = float(np.mean([row["worst"] for row in found["fixed"]]))
        found["worst_over_fixed"] = found["worst"] / worst
    return found


def study(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Learn and measure all cases that are asked for."""
    torch.set_num_threads(1)
    return {case: measure(case, arguments, bar) for case in arguments.case}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--folder", type=Path, default=Path("runs/parameters"))
    parser.add_argument("--quick", action="store_true", help="small sizes, which show nothing")
    measure_and_write(parser, study)


if __name__ == "__main__":
    main()
