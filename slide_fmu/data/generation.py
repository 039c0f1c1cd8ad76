"""All trajectories of a recipe are made here, on any executor.

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
from slide_fmu.data.apart import ended_process
from slide_fmu.data.damage import forget_damaged
from slide_fmu.data.failures import too_many_failures
from slide_fmu.data.fingerprint import identity
from slide_fmu.data.pool import as_done
from slide_fmu.data.store import open_store
from slide_fmu.data.trajectories import missing_trajectories
from slide_fmu.data.worker import Order, Tally, make_ordered, make_trajectories
from slide_fmu.data.zarr_group import Shapes
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.systems.answers import asked_of_sources
from slide_fmu.systems.base import Source, System
from slide_fmu.systems.errors import SimulationError

JOBS, MOST_IN_A_JOB = 4096, 16
"""Of more trajectories than ``JOBS`` a job has several, since to hand one out takes about a
millisecond of one process. It has few, so that the last workers end at about the same time."""


def generate(
    case: Case,
    path: Path,
    executor: Executor | None,
    progress: Progress,
    beside: Path | None = None,
) -> int:
    """Make all trajectories of a recipe that its store does not hold yet.

    The store is created where there is none. Without an
    executor this process makes them. Several processes may do so at once, on one store: each
    trajectory is made by one of them, and each process ends when all trajectories are there. The
    progress is called at the start and after every job. A trajectory that cannot be simulated is
    kept beside the store (``slide_fmu.data.failures``), and another draw takes its place. One
    whose files are lost or damaged is made again.

    Args:
        case: the recipe whose trajectories are made, all of whose numbers are known.
        path: place of the store.
        executor: does the work; None for this process.
        progress: shows how many trajectories are there.
        beside: folder of the recipe where the executor's workers run elsewhere, since they look
            for the recipe's own files there; None otherwise.

    Returns:
        How many trajectories this process or its executor made.

    Raises:
        RecipeError: the recipe leaves something to be found.
        StoreError: the store belongs to another recipe or model, or workers do not see it.
        SimulationError: too many trajectories could not be simulated, or the model ended the
            process that simulated it; trajectories in the store stay there.
    """
    recipe, source = case.recipe, case.source
    path = path.absolute()
    open_store(path, recipe, shapes_of(recipe, source), identity(source, recipe))
    forget_damaged(recipe, path)
    return fill_store(source, case, path, executor, progress, beside)


@asked_of_sources
def fill_store(
    system: System,
    case: Case,
    path: Path,
    executor: Executor | None,
    progress: Progress,
    beside: Path | None,
) -> int:
    """Simulate the trajectories that the store does not hold yet; return their number.

    Arguments and errors are those of ``generate``; workers make systems of their own.
    """
    recipe = case.recipe
    wanted, make = _missing(recipe, path), _maker(case, path, executor, beside)
    total = sum(recipe.count(split) for split in SPLITS)
    before, made = total - len(wanted), 0
    progress(before, total)
    pauses = _pauses()
    try:
        while wanted:
            busy: list[tuple[str, int]] = []
            with closing(as_done(executor, make, _jobs(wanted))) as tallies:
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


def _missing(recipe: Recipe, path: Path) -> list[tuple[str, int]]:
    """List split and index of the trajectories that the store lacks."""
    return [
        (split, index)
        for split in SPLITS
        for index in missing_trajectories(path, split, recipe.count(split))
    ]


def _maker(
    case: Case, path: Path, executor: Executor | None, beside: Path | None
) -> Callable[[tuple[tuple[str, int], ...]], Tally]:
    """Return what makes the trajectories of a job: here, or from an order where it crosses."""
    if executor is None:
        return partial(make_trajectories, case, path)
    folder = None if beside is None else str(beside.absolute())
    return partial(make_ordered, Order(pickle.dumps(case), str(path), folder))


def _jobs(wanted: list[tuple[str, int]]) -> Iterator[tuple[tuple[tuple[str, int], ...]]]:
    """Divide what is wanted into jobs."""
    size = min(max(len(wanted) // JOBS, 1), MOST_IN_A_JOB)
    for first in range(0, len(wanted), size):
        yield (tuple(wanted[first : first + size]),)


def _pauses() -> Iterator[float]:
    """Give the times in s between two looks at what other processes make: longer and longer."""
    yield from (0.1, 0.2, 0.5, 1.0)
    while True:
        yield 2.0
