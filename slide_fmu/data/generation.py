"""This module makes all trajectories of a recipe, on any executor.

A generation may be killed at any moment: the next one makes what is missing.
"""

from __future__ import annotations

import pickle
import random
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor
from contextlib import closing
from functools import partial
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.apart import ended_process
from slide_fmu.data.failures import forget_failed, too_many_failures
from slide_fmu.data.pool import as_done
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.data.worker import Order, Tally, make_ordered, make_trajectories
from slide_fmu.recipe.case import Case
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError

JOBS, MOST_IN_A_JOB = 4096, 16
"""A job has several trajectories if there are more than ``JOBS``, since handing out a job takes
about a millisecond. It has few, so that all workers end at about the same time."""


def generate(
    case: Case,
    folder: Path,
    executor: Executor | None,
    progress: Progress,
    recipe_folder: Path | None = None,
) -> int:
    """Make all trajectories of a recipe that a folder does not hold yet.

    Without an executor this process makes the trajectories. Several processes may do so at once,
    in one folder: each leaves out what another has made, and ends when all trajectories are
    there. The progress is called at the start and after every job. A trajectory that cannot be
    simulated is kept in ``slide_fmu.data.failures``, and another draw takes its place. A damaged
    trajectory is made again.

    Args:
        case: the recipe whose trajectories are made; all its numbers are known.
        folder: the folder; it is made if it does not exist.
        executor: the executor; None for this process.
        progress: shows how many trajectories are there.
        recipe_folder: folder of the recipe if the executor's workers run elsewhere, since they
            look for the recipe's own files there; None otherwise.

    Returns:
        Number of trajectories that this process or its executor made.

    Raises:
        RecipeError: the recipe leaves values open.
        ClusterError: workers do not see the folder, or simulate another model.
        SimulationError: too many trajectories could not be simulated, or the model ended the
            process that simulated it; trajectories that were made stay.
    """
    trajectories = Trajectories.of(case, folder.absolute())
    return make_missing(case.source, trajectories, executor, progress, recipe_folder)


@asked_of_sources
def make_missing(
    system: System,
    trajectories: Trajectories,
    executor: Executor | None,
    progress: Progress,
    recipe_folder: Path | None,
) -> int:
    """Simulate the trajectories that are missing; return their number.

    Arguments and errors are as in ``generate``; workers make systems of their own.
    """
    recipe = trajectories.case.recipe
    if too_many_failures(trajectories) is not None:  # the model may be corrected by now
        forget_failed(trajectories)
    missing, make = trajectories.missing(), _maker(trajectories, executor, recipe_folder)
    total = recipe.total_count
    there, made = total - len(missing), 0
    progress(there, total)
    # programs that work in the same folder seldom meet at the same trajectory so
    random.SystemRandom().shuffle(missing)
    try:
        with closing(as_done(executor, make, _jobs(missing))) as tallies:
            for _, tally in tallies:
                problem = too_many_failures(trajectories)
                if problem is not None:
                    raise SimulationError(problem)
                made, there = made + tally.made, there + tally.made + tally.present
                progress(there, total)
    except BrokenExecutor as error:
        named = recipe.system.model, recipe.system.kind
        raise SimulationError(ended_process(*named)) from error
    return made


def _maker(
    trajectories: Trajectories, executor: Executor | None, recipe_folder: Path | None
) -> Callable[[tuple[tuple[str, int], ...]], Tally]:
    """Return the function that makes the trajectories of a job, here or in a worker."""
    if executor is None:
        return partial(make_trajectories, trajectories)
    place = None if recipe_folder is None else str(recipe_folder.absolute())
    case, folder = pickle.dumps(trajectories.case), str(trajectories.folder)
    return partial(make_ordered, Order(case, folder, trajectories.model, place))


def _jobs(missing: list[tuple[str, int]]) -> Iterator[tuple[tuple[tuple[str, int], ...]]]:
    """Divide the missing trajectories into jobs."""
    size = min(max(len(missing) // JOBS, 1), MOST_IN_A_JOB)
    for first in range(0, len(missing), size):
        yield (tuple(missing[first : first + size]),)
