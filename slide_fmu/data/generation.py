"""All trajectories of a recipe are made here, on any executor.

A generation may be killed at any moment: the next one makes what is missing.
"""

from __future__ import annotations

import json
import threading
from concurrent.futures import BrokenExecutor, Executor
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.data.apart import ended_process
from slide_fmu.data.draws import draw, simulate_draw, split_stream
from slide_fmu.data.failures import (
    Failure,
    allowed_failures,
    keep_failure,
    too_many_failures,
)
from slide_fmu.data.identity import identity
from slide_fmu.data.parameter_draws import as_row, drawn_parameters
from slide_fmu.data.pool import in_parallel
from slide_fmu.data.recorded import stretches
from slide_fmu.data.store import Shapes, missing_trajectories, open_store, write_trajectory
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.recipe.systems import recipe_source, recipe_system
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.record.model import MeasuredRecords


def generate(recipe: Recipe, path: Path, executor: Executor | None, progress: Progress) -> int:
    """Make all trajectories of a recipe that its store does not hold yet, and return their number.

    Those of records are cut out of them. The store is created where there is none. Without an
    executor this process makes them. The progress is called at the start and after every
    trajectory. A trajectory that cannot be simulated is kept beside the store
    (``slide_fmu.data.failures``), and another draw takes its place.

    Raises:
        RecipeError: the recipe leaves something to be found.
        StoreError: the store belongs to another recipe or model.
        SimulationError: too many trajectories could not be simulated, or the model ended the
            process that simulated it; trajectories in the store stay there.
    """
    recipe.require_resolved()
    source = recipe_source(recipe)
    count = round(recipe.data.duration / recipe.window.step)
    shapes: Shapes = {
        "inputs": (count, len(source.inputs)),
        "outputs": (count + 1, len(source.outputs)),
    }
    if recipe.parameters:
        shapes["parameters"] = (len(recipe.parameters),)
    open_store(path, recipe, shapes, identity(recipe, source))
    if isinstance(source, MeasuredRecords):
        return _keep_stretches(recipe, source, path, progress)
    counts = {split: recipe.count(split) for split in SPLITS}
    text = recipe_json(recipe)
    jobs = [
        (text, str(path), split, index)
        for split, count in counts.items()
        for index in missing_trajectories(path, split, count)
    ]
    total = sum(counts.values())
    before = total - len(jobs)
    progress(before, total)
    _worker.made = None  # an object of the same name may be another one by now

    def made(count: int) -> None:
        problem = too_many_failures(path, recipe)
        if problem is not None:
            raise SimulationError(problem)
        progress(before + count, total)

    try:
        in_parallel(executor, _generate_one, jobs, made)
    except BrokenExecutor as error:
        named = recipe.system.model, recipe.system.kind
        raise SimulationError(ended_process(*named)) from error
    return len(jobs)


def _keep_stretches(
    recipe: Recipe, source: MeasuredRecords, path: Path, progress: Progress
) -> int:
    """Cut the stretches of all parts that the store does not hold yet; return their number."""
    missing = {split: missing_trajectories(path, split, recipe.count(split)) for split in SPLITS}
    total = sum(recipe.count(split) for split in SPLITS)
    done = total - sum(map(len, missing.values()))
    made = 0
    progress(done, total)
    for split, indices in missing.items():
        found = stretches(recipe, source, split) if indices else []
        for index in indices:
            stretch = found[index]
            values = as_row(stretch.parameters) if stretch.parameters else None
            write_trajectory(path, split, index, stretch.trajectory, stretch.file, values)
            made += 1
            progress(done + made, total)
    return made


def recipe_json(recipe: Recipe) -> str:
    """Write a recipe as plain JSON, which crosses to every executor and is cheap to compare.

    The tables of signals keep their order, which is that of the columns in the data.
    """
    return json.dumps(recipe.model_dump(mode="json"))


class _Worker(threading.local):
    """A worker keeps the recipe and the system that it made last, one for each thread.

    Systems are costly to build and hold a state: two threads must not step the same one.
    """

    made: tuple[str, Recipe, System] | None = None


_worker = _Worker()


def _generate_one(text: str, path: str, split: str, index: int) -> None:
    if _worker.made is None or _worker.made[0] != text:
        recipe = Recipe.model_validate_json(text)
        _worker.made = text, recipe, recipe_system(recipe)
    _, recipe, system = _worker.made
    stream = split_stream(recipe, split, index)
    parameters = drawn_parameters(recipe, stream, index)
    if parameters:
        system = recipe_system(recipe.at(parameters))
    for attempt in range(allowed_failures(recipe) + 1):
        drawn = draw(recipe, system, stream, index, attempt)
        try:
            trajectory = simulate_draw(system, drawn)
        except SimulationError as error:
            failure = Failure(split, index, attempt, error.time, _told(error, parameters))
            keep_failure(Path(path), failure, system, drawn.inputs)
        else:
            values = as_row(parameters) if parameters else None
            write_trajectory(Path(path), split, index, trajectory, drawn.kind, values)
            return


def _told(error: SimulationError, parameters: dict[str, float]) -> str:
    """Return what went wrong, and with which physical parameters."""
    values = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
    return f"{error} (with {values})" if values else str(error)
