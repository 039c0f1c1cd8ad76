"""A worker makes trajectories, in its own process or thread, on this machine or another.

A worker simulates a trajectory only if it is not in the store yet and no other worker simulates
it. So the same job may be given to several workers, or again to another if one has died: finished
trajectories are never repeated.
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

from slide_fmu.data.claims import claimed
from slide_fmu.data.draws import (
    BEYOND_ATTEMPTS,
    attempted,
    draw,
    draw_inputs,
    simulate_draw,
    split_stream,
)
from slide_fmu.data.errors import StoreError
from slide_fmu.data.failures import Failure, allowed_failures, keep_failure
from slide_fmu.data.fingerprint import identity
from slide_fmu.data.origin import require_motion
from slide_fmu.data.parameter_draws import (
    as_row,
    case_at,
    drawn_parameters,
    leaves_ranges,
    with_values,
)
from slide_fmu.data.store import Store, open_store
from slide_fmu.recipe.case import Case
from slide_fmu.systems.errors import SimulationError

APPEARS = 10.0
"""A store that another machine has just made appears on a shared disk within this time, in s."""
KEPT = 64
"""A process keeps the cases of at most this many orders and threads."""


@dataclass(frozen=True)
class Order:
    """An Order holds the common data of all jobs of a generation.

    Attributes:
        case: the pickle of a ``Case``, of which each worker makes its own systems.
        store: absolute path of the store.
        recipe_folder: absolute path of the recipe's folder, in which workers elsewhere look for
            its own files; None for workers that this process started.
        number: number of the generation; its model may have changed since the one before.
    """

    case: bytes
    store: str
    recipe_folder: str | None = None
    number: str = field(default_factory=lambda: uuid.uuid4().hex)


@dataclass(frozen=True)
class Tally:
    """A Tally counts the results of a job.

    Attributes:
        made: number of trajectories that were simulated and written now.
        found: number of trajectories that were in the store already.
        busy: split and index of trajectories that another process simulates, or did until it died.
    """

    made: int
    found: int
    busy: tuple[tuple[str, int], ...]


def make_ordered(order: Order, wanted: tuple[tuple[str, int], ...]) -> Tally:
    """Make the wanted trajectories of an order, as ``make_trajectories`` does.

    Raises:
        LoadError: the system cannot be made here.
        StoreError: this machine does not see the store, or the model is another one here.
        OSError: as in ``make_trajectories``.
    """
    case = _case_of(order, threading.get_ident())
    return make_trajectories(case, open_store(Path(order.store)), wanted)


@lru_cache(maxsize=KEPT)
def _case_of(order: Order, thread: int) -> Case:
    """Return the case of an order; a model that differs on this machine is refused.

    Systems hold a state, so two threads (``threading.get_ident``) must not step the same one.
    """
    if order.recipe_folder is not None:
        _require_disk(Path(order.store))
        if order.recipe_folder not in sys.path:
            sys.path.insert(0, order.recipe_folder)
    case: Case = pickle.loads(order.case)
    if order.recipe_folder is not None:  # packages and files may differ between the machines
        where = f"the worker on {socket.gethostname()}"
        require_motion(open_store(Path(order.store)), identity(case.source, case.recipe), where)
    return case


def make_trajectories(case: Case, store: Store, wanted: Sequence[tuple[str, int]]) -> Tally:
    """Make the trajectories that are wanted, by split and index, unless they are done or claimed.

    Args:
        case: the recipe, whose system is simulated.
        store: the store.
        wanted: split and index of each.

    Raises:
        OSError: a trajectory cannot be written, or the disk has no locks.
    """
    made, found, busy = 0, 0, []
    for split, index in wanted:
        stored = store.split(split)
        if stored.is_done(index):
            found += 1
            continue
        with claimed(store.path, split, index) as free:
            if not free:
                busy.append((split, index))
            elif stored.is_done(index):  # since another process had the claim
                found += 1
            else:
                _make(case, store, split, index)
                made += 1
    return Tally(made, found, tuple(busy))


def _require_disk(store: Path) -> None:
    """Refuse to work on a machine without access to the disk of the store."""
    end = time.monotonic() + APPEARS
    while not store.exists():
        if time.monotonic() > end:
            raise StoreError(
                f"the worker on {socket.gethostname()} does not see {str(store)!r}; expected a "
                "disk that all machines share under the same path: keep the work on such a disk "
                "(--runs FOLDER)"
            )
        time.sleep(0.5)


def _make(case: Case, store: Store, split: str, index: int) -> None:
    """Simulate a trajectory and write it; further draws take the place of one that fails."""
    recipe = case.recipe
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
            keep_failure(store.path, failure, case.system, inputs)
        else:
            values = as_row(parameters) if parameters else None
            store.split(split).write(index, trajectory, drawn.kind, values)
            return
