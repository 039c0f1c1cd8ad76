"""Physical parameters in a surrogate, beside surrogates trained for fixed values.

    python tests/benchmarks/parameters.py --folder runs/parameters --json -

The Duffing oscillator under a force that is drawn anew for every sample, with a mass of 1 to 3
kg and a damping of 16 or 8 N s/m, or with mass and stiffness; and the tutorials' quarter car
with a body of 250 to 500 kg. One surrogate follows the parameters; others are trained for fixed
values, with the same data in all. Errors are relative RMSE about the mean, sample by sample, on
records that no training saw: at 20 unseen values, four records each, and at the corners. Each
surrogate for a fixed value is measured on the inputs of all of these records: so the worst of 20
stands beside the mean of four worst of 20. What is done is kept in the folder, and not done
again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from figures_out import measure_and_write

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.measures import rms
from slide_fmu.core.parameters import corners_of
from slide_fmu.core.progress import Stages
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.data.generation import generate
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.fitting.preparation import Work
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate
from tests.recipes import whole_recipe

BEYOND = {"beyond": 0.05}
MASS = {"range": [1.0, 3.0], "unit": "kg", "transform": "reciprocal", **BEYOND}
STIFFNESS = {"range": [1000.0, 2500.0], "unit": "N/m", "transform": "log", **BEYOND}
BODY = {"range": [250.0, 500.0], "unit": "kg", "transform": "reciprocal", **BEYOND}
CAR = Path(__file__).parents[2] / "docs/tutorials/quarter_car_function.py"


@dataclass(frozen=True)
class Case:
    """A case is a system with open parameters, and how much is learnt of it.

    Attributes:
        system: table ``system`` of the recipe.
        parameters: tables of the open parameters.
        truncated: samples that the window truncates.
        train: number of trajectories to learn from.
        step: sample step in s.
        order: states of the network, those of the padding apart.
        excitation: kinds of excitation; those that follow from the step if empty.
        fixed: values of the first parameter for which surrogates of their own are trained.
    """

    system: dict[str, Any]
    parameters: dict[str, Any]
    truncated: int
    train: int = 100
    step: float = 0.03
    order: int = 2
    excitation: tuple[dict[str, Any], ...] = ({"kind": "held_random", "weight": 1.0},)
    fixed: tuple[float, ...] = ()


def duffing(damping: float) -> dict[str, Any]:
    """Return the table ``system`` of a Duffing oscillator with a damping in N s/m."""
    values = {"substeps": 12, "damping": damping}
    return {"model": "mbs_models.oscillators:DuffingOscillator", "parameters": values}


OUTPUTS = {"body_acceleration": 20.0, "suspension_travel": 0.1, "tyre_deflection": 0.05}
QUARTER_CAR = {
    "kind": "function",
    "model": str(CAR),
    "inputs": {"road": {"range": [-0.05, 0.05]}},
    "outputs": {name: {"range": [-limit, limit]} for name, limit in OUTPUTS.items()},
}
MASSES = (1.0, 1.5, 2.0, 3.0)
CASES = {
    "mass_16": Case(duffing(16.0), {"mass": MASS}, 174, fixed=MASSES),
    "mass_8": Case(duffing(8.0), {"mass": MASS}, 400, fixed=MASSES),
    "two": Case(duffing(16.0), {"mass": MASS, "stiffness": STIFFNESS}, 174, 200),
    "car": Case(
        QUARTER_CAR, {"body_mass": BODY}, 240, 48, 0.01, 4, (), (250.0, 300.0, 370.0, 500.0)
    ),
}
N_OUT, DURATION = 60, 30.0
FURTHER = 1.2
"""Amplitudes of what is learnt from are so many times as large, and clipped to the range."""
UNSEEN, RECORDS, SEED = 20, 4, 20270001


def recipe_of(name: str, quick: bool) -> Recipe:
    """Return the recipe of a case; a quick one only shows that the benchmark works."""
    case = CASES[name]
    mix = {"excitation": case.excitation} if case.excitation else {}
    tables = {
        "name": name,
        "description": "a system with physical parameters",
        "system": case.system,
        "parameters": case.parameters,
        "window": {"step": case.step, "n_in": case.truncated + N_OUT, "n_out": N_OUT},
        "data": {
            "seed": 1,
            "duration": 20.0,
            "burn_in": case.truncated * case.step,
            "train": 8 if quick else case.train,
            "validation": 4 if quick else min(32, case.train // 3),
            **mix,
        },
        "network": {"order": case.order, "hidden": 4 if quick else 32},
        "training": {
            "starts": 3,
            "expert": {"part": 3, "kept": 2, "kept_iterations": 25},
            **({"starts": 1, "iterations": 3} if quick else {}),
        },
    }
    return whole_recipe(tables)


def fixed_recipe(recipe: Recipe, value: float, parts: int) -> Recipe:
    """Return the recipe for one value of the first parameter, with its part of the data."""
    name = next(iter(recipe.parameters))
    part = recipe.data.model_copy(update={"train": max(2, recipe.data.train // parts)})
    return recipe.at({name: value}).model_copy(update={"data": part})


def wider(recipe: Recipe) -> Recipe:
    """Return the recipe with inputs a little beyond the range, as it is learnt from.

    Heavier masses reach further, and what is reached in no trajectory is not known.
    """
    kinds = []
    for kind in recipe.data.excitation:
        amplitude = getattr(kind, "amplitude", None)  # all but recorded inputs have one
        wide = {} if amplitude is None else {"amplitude": (amplitude[0], FURTHER * amplitude[1])}
        kinds.append(kind.model_copy(update=wide))
    data = recipe.data.model_copy(update={"excitation": tuple(kinds)})
    return recipe.model_copy(update={"data": data})


def learnt(recipe: Recipe, folder: Path, bar: Stages) -> tuple[Surrogate, float]:
    """Return the surrogate of a recipe, and the CPU time in s of its training; made once."""
    recipe, place, seconds = wider(recipe), folder / "surrogate.slide", folder / "seconds.json"
    if not place.exists():
        folder.mkdir(parents=True, exist_ok=True)
        trajectories = folder / "trajectories"
        with ThreadPoolExecutor(1) as pool:
            generate(case_of(recipe), trajectories, pool, bar("trajectories"))
        begin = time.process_time()
        fit = fit_surrogate(Work(case_of(recipe), trajectories, folder / "states", bar))
        seconds.write_text(json.dumps(time.process_time() - begin), encoding="utf-8")
        fit.surrogate.save(place)
    return Surrogate.from_bytes(place.read_bytes()), json.loads(seconds.read_text("utf-8"))


def error_at(
    surrogate: Surrogate, recipe: Recipe, values: Mapping[str, float], first: int, quick: bool
) -> float:
    """Return the relative RMSE with some values, on records of their own from a first one on.

    Of several outputs it is the root of the mean square.
    """
    fixed = recipe.at(values)
    system, stream = case_of(fixed).system, Stream(TEST, SEED, (1.0, 1.0), DURATION)
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
    relative = rms(np.concatenate(misses)) / rms(whole - whole.mean(axis=0))
    return mean_square_root(relative.tolist())


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
    values, parameter = CASES[case].fixed, next(iter(recipe.parameters))
    for value in values[:1] if quick else values:
        own = fixed_recipe(recipe, value, len(values))
        place = folder / f"{parameter}_{value:g}".replace(".", "_")
        alone, seconds = learnt(own, place, bar)
        errors = [
            error_at(alone, own, {parameter: value}, RECORDS * index, quick)
            for index in range(len(points))
        ]
        row = {parameter: value, "rms": mean_square_root(errors), "worst": max(errors)}
        found["fixed"].append({**row, "errors": errors, "cpu_seconds": seconds})
    if values:
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
