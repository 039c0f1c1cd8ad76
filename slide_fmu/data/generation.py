"""All trajectories of a recipe are made here, on any executor.

A generation may be killed at any moment: the next one makes what is missing.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor
from contextlib import closing
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.data.apart import ended_process
from slide_fmu.data.failures import too_many_failures
from slide_fmu.data.identity import identity
from slide_fmu.data.mending import forget_damaged
from slide_fmu.data.own_files import keep_own_files
from slide_fmu.data.parameter_draws import as_row
from slide_fmu.data.pool import IN_FLIGHT, as_done
from slide_fmu.data.recorded import stretches
from slide_fmu.data.shards import WHOLE, Shard
from slide_fmu.data.store import Shapes, missing_trajectories, open_store, write_trajectory
from slide_fmu.data.worker import Order, forget, make_trajectories
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.recipe.systems import recipe_source
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.base import Source
from slide_fmu.systems.errors import SimulationError

MOST_IN_A_JOB = 16
"""A job has at most so many trajectories, so that the last workers end at about the same time."""


def generate(
    recipe: Recipe,
    path: Path,
    executor: Executor | None,
    progress: Progress,
    shard: Shard = WHOLE,
    beside: Path | None = None,
) -> int:
    """Make all trajectories of a recipe that its store does not hold yet.

    Those of records are cut out of them. The store is created where there is none. Without an
    executor this process makes them. Several processes may do so at once, on one store: each
    trajectory is made by one of them, and each process ends when all trajectories are there. The
    progress is called at the start and after every job. A trajectory that cannot be simulated is
    kept beside the store (``slide_fmu.data.failures``), and another draw takes its place. One
    whose files are lost or damaged is made again.

    Args:
        recipe: what is made; all its numbers are known.
        path: place of the store.
        executor: does the work; None for this process.
        progress: shows how many trajectories of the shard are there.
        shard: the part of the trajectories that is made.
        beside: folder of the recipe where the executor's workers may run elsewhere, so that the
            recipe's own files are copied to the store's disk, which they share; None otherwise.

    Returns:
        How many trajectories this process or its executor made.

    Raises:
        RecipeError: the recipe leaves something to be found.
        StoreError: the store belongs to another recipe or model, or workers do not see it.
        SimulationError: too many trajectories could not be simulated, or the model ended the
            process that simulated it; trajectories in the store stay there.
    """
    recipe.require_resolved()
    path = path.absolute()
    source = recipe_source(recipe)
    open_store(path, recipe, shapes_of(recipe, source), identity(recipe, source))
    forget_damaged(recipe, path, shard)
    if isinstance(source, MeasuredRecords):
        return _keep_stretches(recipe, source, path, progress)
    wanted, total = _missing(recipe, path, shard)
    own_files = None if beside is None else str(keep_own_files(recipe, beside, path))
    order = Order(recipe_json(recipe), str(path), own_files)
    forget()
    before, made = total - len(wanted), 0
    progress(before, total)
    pauses = _pauses()
    try:
        while wanted:
            busy: list[tuple[str, int]] = []
            with closing(as_done(executor, make_trajectories, _jobs(order, wanted))) as tallies:
                for _, tally in tallies:
                    problem = too_many_failures(path, recipe)
                    if problem is not None:
                        raise SimulationError(problem)
                    made, before = made + tally.made, before + tally.made + tally.found
                    busy.extend(tally.busy)
                    progress(before, total)
            wanted = busy
            if wanted:  # another process makes them; should it die, they are made here
                time.sleep(next(pauses))
    except BrokenExecutor as error:
        named = recipe.system.model, recipe.system.kind
        raise SimulationError(ended_process(*named)) from error
    return made


def shapes_of(recipe: Recipe, source: Source) -> Shapes:
    """Return the shapes of what is stored of a trajectory."""
    count = round(recipe.data.duration / recipe.window.step)
    shapes: Shapes = {
        "inputs": (count, len(source.inputs)),
        "outputs": (count + 1, len(source.outputs)),
    }
    if recipe.parameters:
        shapes["parameters"] = (len(recipe.parameters),)
    return shapes


def _missing(recipe: Recipe, path: Path, shard: Shard) -> tuple[list[tuple[str, int]], int]:
    """List the trajectories of a shard that the store lacks, and count all of the shard."""
    wanted, total, before = [], 0, 0
    for split in SPLITS:
        count = recipe.count(split)
        missing = missing_trajectories(path, split, count, shard, before)
        wanted += [(split, index) for index in missing]
        total += len(shard.indices(count, before))
        before += count
    return wanted, total


def _jobs(
    order: Order, wanted: list[tuple[str, int]]
) -> Iterator[tuple[Order, tuple[tuple[str, int], ...]]]:
    """Divide what is wanted into jobs; of very many trajectories a job has several.

    To hand out a job takes about a millisecond of one process, however many workers there are.
    """
    size = job_size(len(wanted))
    for first in range(0, len(wanted), size):
        yield order, tuple(wanted[first : first + size])


def job_size(trajectories: int) -> int:
    """Return how many trajectories a job has where so many are wanted."""
    return min(max(trajectories // IN_FLIGHT, 1), MOST_IN_A_JOB)


def _pauses() -> Iterator[float]:
    """Give the times in s between two looks at what other processes make: longer and longer."""
    yield from (0.1, 0.2, 0.5, 1.0)
    while True:
        yield 2.0


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
