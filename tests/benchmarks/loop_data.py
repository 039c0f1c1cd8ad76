"""Errors of coupled runs of a surrogate that has learnt with motions in loops, and without.

Both learn from the same number of trajectories of the lower half of a quarter car, with the same
network and seeds. They are coupled with bodies by Newton's method, over a road that no training
saw; errors are those of the body's position (``tests/benchmarks/coupled.py``).

    PYTHONPATH=. python tests/benchmarks/loop_data.py --json -

It takes about ten CPU-minutes. ``--folder FOLDER`` keeps trajectories, trainings and FMUs.
"""

from __future__ import annotations

import argparse
import math
import statistics
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.pipeline.job import checked, open_job
from slide_fmu.pipeline.stages import generate_recipe, train_surrogate
from tests.benchmarks.coupled import METHODS, STEPS, ride
from tests.benchmarks.figures_out import measure_and_write
from tests.own_models.halves.cut_car import relative_error, road, whole, write_halves

RECIPE = Path(__file__).parents[1] / "own_models" / "halves" / "lower_half.toml"
MODEL = "../quarter_car_corner.py"
LOOP = """
[[loop]]
output = "force"
input = "body"
weight = WEIGHT
mass = [12.0, 400.0]
"""
VARIANTS = ("without loops", "with loops")


def recipe_in(folder: Path, name: str, weight: float) -> Path:
    """Write the recipe, with a loop of a weight next to 1 for all other kinds; return its path."""
    text = RECIPE.read_text("utf-8").replace(MODEL, (RECIPE.parent / MODEL).resolve().as_posix())
    if name == VARIANTS[1]:
        text += LOOP.replace("WEIGHT", str(weight))
    path = folder / name.replace(" ", "_") / "lower_half.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")
    return path


def learnt(recipe: Path, seed: int, bar: Stages) -> Path:
    """Learn from a recipe with a seed of the training; return the FMU."""
    job = open_job(recipe, recipe.parent, bar, seed)
    generate_recipe(job, 0, None, False)
    train_surrogate(checked(job))
    surrogate = job.folder.load_surrogate(job.recipe).surrogate
    return export_fmu(surrogate, recipe.with_name(f"seed_{seed}.fmu"))


def error_of(
    halves: dict[str, Path], mass: float, step: float, truth: FloatArray, stop: float
) -> float:
    """Return the relative error of a ride; infinity where it has grown without bound."""
    try:
        run = ride(halves, mass, step, stop, **METHODS["newton"])
    except CoSimulationError:
        return math.inf
    return relative_error(np.interp(road(stop)[0], run.time, run["upper.position"]), truth)


def spread_of(errors: list[float]) -> dict[str, Any]:
    """Return errors with their median and the largest one."""
    return {"median": statistics.median(errors), "largest": max(errors), "all": errors}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Learn all variants with all seeds, and measure them with all bodies and steps."""
    folder = Path(arguments.folder or tempfile.mkdtemp())
    fmus = {
        name: [
            learnt(recipe_in(folder, name, arguments.weight), seed, bar)
            for seed in arguments.seeds
        ]
        for name in VARIANTS
    }
    progress, found = bar("coupled"), dict[str, Any]()
    halves = write_halves(folder)
    for number, mass in enumerate(arguments.masses):
        progress(number, len(arguments.masses))
        truth = whole(mass, *road(arguments.stop))
        found[f"{mass:g} kg"] = {
            f"{1e3 * step:g} ms": {
                name: spread_of(
                    [
                        error_of({**halves, "lower": fmu}, mass, step, truth, arguments.stop)
                        for fmu in fmus[name]
                    ]
                )
                for name in VARIANTS
            }
            for step in STEPS
        }
    progress(len(arguments.masses), len(arguments.masses))
    return {"duration_s": arguments.stop, "seeds": arguments.seeds, "bodies": found}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stop", type=float, default=60.0, help="duration of a ride in s")
    parser.add_argument("--folder", type=Path, help="folder for trajectories, trainings and FMUs")
    parser.add_argument("--weight", type=float, default=0.43, help="weight of the loop")
    parser.add_argument("--masses", type=float, nargs="+", default=[300.0, 25.0, 12.0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    measure_and_write(parser, measure)
