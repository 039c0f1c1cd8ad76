"""This module makes all trajectories of a recipe, on any executor.

A generation may be killed at any moment: the next one makes what is missing. Its workers run in
this process or another, on this machine or another. A worker leaves out a trajectory that is there
already, so the same job may be given to several workers, or again to another if one has died:
finished trajectories are never repeated.
"""

from __future__ import annotations

import os
import pickle
import random
import socket
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from pathlib import Path

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.cluster import ClusterError
from slide_fmu.data.draws import (
    BEYOND_ATTEMPTS,
    Draw,
    Stream,
    attempted,
    draw,
    draw_inputs,
    drawn_at_once,
    drawn_trajectory,
    split_stream,
)
from slide_fmu.data.failures import (
    Failure,
    allowed_failures,
    forget_failed,
    keep_failure,
    too_many_failures,
)
from slide_fmu.data.isolated_process import ended_process
from slide_fmu.data.model_answers import identity, kept_answers, same_motion
from slide_fmu.data.parameter_draws import (
    as_row,
    case_at,
    drawn_parameters,
    leaves_ranges,
    with_values,
)
from slide_fmu.data.pool import as_done
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.recipe.case import Case
from slide_fmu.systems.base import ShowingStates, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate_motions

JOBS, MOST_IN_A_JOB = 4096, 16
"""A job has several trajectories if there are more than ``JOBS``, since handing out a job takes
about a millisecond. It has few, so that all workers end at about the same time."""
LEAST_AT_ONCE = 64
"""A job of trajectories that are simulated at once has at least this number of them, since fewer
take hardly less time."""
APPEARS = 10.0
"""A folder that another machine has just made appears on a shared disk within this time, in s."""
KEPT = 64
"""A process keeps the cases of at most this many orders and threads."""


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
    jobs = _jobs(missing, _at_once(trajectories))
    try:
        with closing(as_done(executor, make, jobs)) as tallies:
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


def _jobs(
    missing: list[tuple[str, int]], at_once: int
) -> Iterator[tuple[tuple[tuple[str, int], ...]]]:
    """Divide the missing trajectories into jobs, for a system that simulates several at once."""
    size = min(max(len(missing) // JOBS, 1), MOST_IN_A_JOB)
    if at_once > 1:
        for_each_core = -(-len(missing) // (os.cpu_count() or 1))
        size = min(max(for_each_core, LEAST_AT_ONCE), at_once)
    for first in range(0, len(missing), size):
        yield (tuple(missing[first : first + size]),)


@dataclass(frozen=True)
class Order:
    """An Order holds the common data of all jobs of a generation.

    Attributes:
        case: the pickle of a ``Case``, of which each worker makes its own systems.
        folder: absolute path of the trajectories.
        model: key of the model's answers.
        recipe_folder: absolute path of the recipe's folder, in which workers elsewhere look for
            its own files; None for workers that this process started.
        number: number of the generation; its model may have changed since the one before.
    """

    case: bytes
    folder: str
    model: str
    recipe_folder: str | None = None
    number: str = field(default_factory=lambda: uuid.uuid4().hex)


@dataclass(frozen=True)
class Tally:
    """A Tally counts the results of a job.

    Attributes:
        made: number of trajectories that were simulated and written now.
        present: number of trajectories that were there already.
    """

    made: int
    present: int


def make_ordered(order: Order, wanted: tuple[tuple[str, int], ...]) -> Tally:
    """Make the wanted trajectories of an order, as ``make_trajectories`` does."""
    return make_trajectories(_trajectories_of(order, threading.get_ident()), wanted)


@lru_cache(maxsize=KEPT)
def _trajectories_of(order: Order, thread: int) -> Trajectories:
    """Return the trajectories of an order; a model that differs on this machine is refused.

    Systems hold a state, so two threads (``threading.get_ident``) must not step the same one.
    """
    folder = Path(order.folder)
    if order.recipe_folder is not None:
        _require_disk(folder)
        if order.recipe_folder not in sys.path:
            sys.path.insert(0, order.recipe_folder)
    case: Case = pickle.loads(order.case)
    if order.recipe_folder is not None:  # packages and files may differ between the machines
        _require_same_model(case, folder, order.model)
    return Trajectories(folder, case, order.model)


def _require_disk(folder: Path) -> None:
    """Refuse to work on a machine without access to the disk of the trajectories."""
    end = time.monotonic() + APPEARS
    while not folder.exists():
        if time.monotonic() > end:
            raise ClusterError(
                f"the worker on {socket.gethostname()} does not see {str(folder)!r}; expected a "
                "disk that all machines share under the same path: keep the work on such a disk "
                "(--runs FOLDER)"
            )
        time.sleep(0.5)


def _require_same_model(case: Case, folder: Path, model: str) -> None:
    """Refuse to simulate a model that answers otherwise here than where the work was ordered."""
    if not same_motion(kept_answers(folder, model), identity(case.source, case.recipe)):
        raise ClusterError(
            f"the worker on {socket.gethostname()} simulates another motion than the machine that "
            f"makes trajectories in {folder}; expected the same model: install the same packages "
            "there, and restart the workers, since they keep what they have loaded"
        )


def make_trajectories(trajectories: Trajectories, wanted: Sequence[tuple[str, int]]) -> Tally:
    """Make the trajectories that are wanted, by split and index, unless they are there.

    As many are simulated at once as the system offers. Further draws take the place of those that
    fail.
    """
    made, size = 0, _at_once(trajectories)
    for first in range(0, len(wanted), size):
        part = wanted[first : first + size]
        # another program may have made them by now
        tries = [Try(trajectories, *one, 0) for one in part if not trajectories.is_whole(*one)]
        made += len(tries)
        while tries:
            tries = _failed(tries)
            if tries and too_many_failures(trajectories) is not None:
                break  # which ends the generation
    return Tally(made, len(wanted) - made)


def _at_once(trajectories: Trajectories) -> int:
    """Give the number of trajectories that the system of a case simulates at once."""
    recipe = trajectories.case.recipe
    return drawn_at_once(recipe, trajectories.case.system, recipe.data.duration)


@dataclass(frozen=True)
class Try:
    """A Try makes a trajectory from one of its draws.

    Attributes:
        trajectories: where it is written.
        split, index: which one it is.
        attempt: number of draws before this one, on which the system failed.
    """

    trajectories: Trajectories
    split: str
    index: int
    attempt: int

    @property
    def stream(self) -> Stream:
        """The stream of seeds that the trajectory belongs to."""
        return split_stream(self.trajectories.case.recipe, self.split, self.index)

    @cached_property
    def parameters(self) -> dict[str, float]:
        """The values of its parameters, by name."""
        recipe = self.trajectories.case.recipe
        return drawn_parameters(recipe, self.stream, self.index, self.attempt)

    def driven(self) -> System:
        """Make the system with these values.

        Raises:
            SimulationError: it cannot be made.
        """
        return case_at(self.trajectories.case, self.parameters).system

    def drawn(self, system: System) -> Draw:
        """Draw its motion; a loop steps the system.

        Raises:
            SimulationError: the system failed in a loop.
        """
        kinds = self.trajectories.case.recipe.drawn_for(self.split)
        return draw(kinds, system, attempted(self.stream, self.attempt), self.index, self.attempt)

    def write(self, trajectory: Trajectory, kind: int) -> None:
        """Write the trajectory, of a kind of the recipe's mix."""
        values = as_row(self.parameters) if self.parameters else None
        self.trajectories.write(self.split, self.index, trajectory, kind, values)

    def fail(self, error: SimulationError, inputs: FloatArray | None) -> Try | None:
        """Keep the failure, and return the next try; None if there is none.

        The inputs, (N, n_inputs), are None where they could not be drawn.
        """
        case, recipe = self.trajectories.case, self.trajectories.case.recipe
        words = with_values(str(error), self.parameters)
        failure = Failure(self.split, self.index, self.attempt, error.time, words)
        if inputs is None:  # of a loop, from outside
            kinds, at = recipe.drawn_for(self.split), attempted(self.stream, self.attempt)
            inputs = draw_inputs(kinds, case.system, at, self.index, self.attempt).inputs
        keep_failure(self.trajectories, failure, inputs)
        leaves = self.stream.beyond or leaves_ranges(recipe, self.stream, self.index)
        last = (BEYOND_ATTEMPTS if leaves else 0) + allowed_failures(recipe)
        if self.attempt == last:
            return None
        return replace(self, attempt=self.attempt + 1)


def _failed(tries: Sequence[Try]) -> list[Try]:
    """Simulate trajectories and write them; return the next tries of those that failed."""
    ready: list[tuple[Try, System, Draw]] = []
    following: list[Try | None] = []
    for one in tries:
        try:
            driven = one.driven()
            ready.append((one, driven, one.drawn(driven)))
        except SimulationError as error:
            following.append(one.fail(error, None))
    case = tries[0].trajectories.case
    motions, systems = [drawn.motion for *_, drawn in ready], [driven for _, driven, _ in ready]
    system = case.system
    if isinstance(system, ShowingStates) and not case.recipe.parameters:
        system = system.showing_states()
        systems = [system] * len(motions)
    answers = simulate_motions(system, motions, systems, case.recipe.parameters)
    for (one, driven, drawn), answer in zip(ready, answers, strict=True):
        if isinstance(answer, SimulationError):
            following.append(one.fail(answer, drawn.inputs))
        else:
            one.write(drawn_trajectory(driven, drawn, answer), drawn.kind)
    return [one for one in following if one is not None]
