"""This module makes all trajectories of a recipe, on any executor.

A generation may be killed at any moment: the next one makes what is missing.
"""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor
from contextlib import closing
from functools import partial
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.apart import ended_process
from slide_fmu.data.failures import kept_failures, too_many_failures
from slide_fmu.data.fingerprint import identity
from slide_fmu.data.pool import as_done
from slide_fmu.data.store import Store
from slide_fmu.data.store_preparation import (
    forget_damaged,
    forget_trajectories,
    prepared_store,
)
from slide_fmu.data.stored_split import Shapes
from slide_fmu.data.worker import Order, Tally, make_ordered, make_trajectories
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.systems.base import Source, System
from slide_fmu.systems.errors import SimulationError

JOBS, MOST_IN_A_JOB = 4096, 16
"""A job has several trajectories if there are more than ``JOBS``, since handing out a job takes
about a millisecond. It has few, so that all workers end at about the same time."""


def generate(
    case: Case,
    path: Path,
    executor: Executor | None,
    progress: Progress,
    recipe_folder: Path | None = None,
) -> int:
    """Make all trajectories of a recipe that its store does not hold yet.

    A missing store is created. Without an executor this process makes the trajectories. Several
    processes may do so at once, on one store: each trajectory is made by one of them, and each
    process ends when all trajectories are there. The progress is called at the start and after
    every job. A trajectory that cannot be simulated is kept in ``slide_fmu.data.failures``, and
    another draw takes its place. A trajectory with lost or damaged files is made again.

    Args:
        case: the recipe whose trajectories are made; all its numbers are known.
        path: place of the store.
        executor: the executor; None for this process.
        progress: shows how many trajectories are there.
        recipe_folder: folder of the recipe if the executor's workers run elsewhere, since they
            look for the recipe's own files there; None otherwise.

    Returns:
        Number of trajectories that this process or its executor made.

    Raises:
        RecipeError: the recipe leaves values open.
        StoreError: the store belongs to another recipe or model, or workers do not see it.
        SimulationError: too many trajectories could not be simulated, or the model ended the
            process that simulated it; trajectories in the store stay there.
    """
    recipe, source = case.recipe, case.source
    shapes, probe = shapes_of(recipe, source), identity(source, recipe)
    store = prepared_store(path.absolute(), recipe, shapes, probe)
    forget_damaged(store, recipe)
    return fill_store(source, case, store, executor, progress, recipe_folder)


@asked_of_sources
def fill_store(
    system: System,
    case: Case,
    store: Store,
    executor: Executor | None,
    progress: Progress,
    recipe_folder: Path | None,
) -> int:
    """Simulate the trajectories that the store does not hold yet; return their number.

    Arguments and errors are as in ``generate``; workers make systems of their own.
    """
    recipe = case.recipe
    if too_many_failures(store.path, recipe) is not None:  # the model may be corrected by now
        for failure in kept_failures(store.path):
            forget_trajectories(store, failure.split, [failure.index])
    wanted, make = _missing(recipe, store), _maker(case, store, executor, recipe_folder)
    total = recipe.total_count
    before, made = total - len(wanted), 0
    progress(before, total)
    pauses = _pauses()
    try:
        while wanted:
            busy: list[tuple[str, int]] = []
            with closing(as_done(executor, make, _jobs(wanted))) as tallies:
                for _, tally in tallies:
                    problem = too_many_failures(store.path, recipe)
                    if problem is not None:
                        raise SimulationError(problem)
                    made, before = made + tally.made, before + tally.made + tally.found
                    busy.extend(tally.busy)
                    progress(before, total)
            wanted = busy
            if wanted:  # another process makes them; if it dies, they are made here
                time.sleep(next(pauses))
    except BrokenExecutor as error:
        named = recipe.system.model, recipe.system.kind
        raise SimulationError(ended_process(*named)) from error
    return made


def shapes_of(recipe: Recipe, source: Source) -> Shapes:
    """Return the shapes of the stored arrays of a trajectory."""
    count = round(recipe.data.duration / recipe.window.step)
    shapes: Shapes = {
        "inputs": (count, len(source.inputs)),
        "outputs": (count + 1, len(source.outputs)),
    }
    if recipe.parameters:
        shapes["parameters"] = (len(recipe.parameters),)
    return shapes


def _missing(recipe: Recipe, store: Store) -> list[tuple[str, int]]:
    """List split and index of the trajectories that the store lacks."""
    return [
        (split, index)
        for split in SPLITS
        for index in store.split(split).missing(recipe.count(split))
    ]


def _maker(
    case: Case, store: Store, executor: Executor | None, recipe_folder: Path | None
) -> Callable[[tuple[tuple[str, int], ...]], Tally]:
    """Return the function that makes the trajectories of a job, here or in a worker."""
    if executor is None:
        return partial(make_trajectories, case, store)
    folder = None if recipe_folder is None else str(recipe_folder.absolute())
    return partial(make_ordered, Order(pickle.dumps(case), str(store.path), folder))


def _jobs(wanted: list[tuple[str, int]]) -> Iterator[tuple[tuple[tuple[str, int], ...]]]:
    """Divide the wanted trajectories into jobs."""
    size = min(max(len(wanted) // JOBS, 1), MOST_IN_A_JOB)
    for first in range(0, len(wanted), size):
        yield (tuple(wanted[first : first + size]),)


def _pauses() -> Iterator[float]:
    """Yield longer and longer times in s between two checks of what other processes have made."""
    yield from (0.1, 0.2, 0.5, 1.0)
    while True:
        yield 2.0
