"""A worker makes trajectories, in its own process or thread, on this machine or another.

A worker leaves out a trajectory that is there already. So the same job may be given to several
workers, or again to another if one has died: finished trajectories are never repeated.
"""

from __future__ import annotations

import pickle
import socket
import sys
import threading
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from slide_fmu.data.cluster import ClusterError
from slide_fmu.data.draws import (
    BEYOND_ATTEMPTS,
    attempted,
    draw,
    draw_inputs,
    simulate_draw,
    split_stream,
)
from slide_fmu.data.failures import Failure, allowed_failures, keep_failure
from slide_fmu.data.model_answers import identity, kept_answers, same_motion
from slide_fmu.data.parameter_draws import (
    as_row,
    case_at,
    drawn_parameters,
    leaves_ranges,
    with_values,
)
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.recipe.case import Case
from slide_fmu.systems.errors import SimulationError

APPEARS = 10.0
"""A folder that another machine has just made appears on a shared disk within this time, in s."""
KEPT = 64
"""A process keeps the cases of at most this many orders and threads."""


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
    """Make the wanted trajectories of an order, as ``make_trajectories`` does.

    Raises:
        LoadError: the system cannot be made here.
        ClusterError: this machine does not see the folder, or the model is another one here.
        OSError: as in ``make_trajectories``.
    """
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

    Raises:
        OSError: a trajectory cannot be written.
    """
    made = 0
    for split, index in wanted:
        if not trajectories.holds(split, index):  # as it may be by now
            _make(trajectories, split, index)
            made += 1
    return Tally(made, len(wanted) - made)


def _make(trajectories: Trajectories, split: str, index: int) -> None:
    """Simulate a trajectory and write it; further draws take the place of one that fails."""
    case, recipe = trajectories.case, trajectories.case.recipe
    stream, kinds = split_stream(recipe, split, index), recipe.drawn_for(split)
    beyond = BEYOND_ATTEMPTS if stream.beyond or leaves_ranges(recipe, stream, index) else 0
    for attempt in range(beyond + allowed_failures(recipe) + 1):
        at = attempted(stream, attempt)
        parameters = drawn_parameters(recipe, stream, index, attempt)
        inputs = None
        try:
            driven = case_at(case, parameters).system
            drawn = draw(kinds, driven, at, index, attempt)
            inputs = drawn.inputs
            trajectory = simulate_draw(driven, drawn)
        except SimulationError as error:
            words = with_values(str(error), parameters)
            failure = Failure(split, index, attempt, error.time, words)
            if inputs is None:  # of a loop, from outside
                inputs = draw_inputs(kinds, case.system, at, index, attempt).inputs
            keep_failure(trajectories, failure, inputs)
        else:
            values = as_row(parameters) if parameters else None
            trajectories.write(split, index, trajectory, drawn.kind, values)
            return
