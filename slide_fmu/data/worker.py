"""What a worker does, in a process or thread of its own, on this machine or another.

A worker simulates a trajectory only if it is not in the store yet and nobody else simulates it. So
the same job may be given to several workers, or again to another where one has died: what is
finished is never repeated.
"""

from __future__ import annotations

import socket
import sys
import threading
import time
import uuid
from dataclasses import dataclass, field
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
    drawn_parameters,
    leaves_ranges,
    system_at,
    with_values,
)
from slide_fmu.data.trajectories import is_done, write_trajectory
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import recipe_system
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError

APPEARS = 10.0
"""A store that another machine has just made appears on a shared disk within this time, in s."""


@dataclass(frozen=True)
class Order:
    """An order is what all jobs of a generation have in common.

    Attributes:
        recipe: the recipe as JSON (``slide_fmu.data.generation.recipe_json``).
        store: absolute path of the store.
        beside: absolute path of the recipe's folder, in which workers elsewhere look for its own
            files; None for workers that this process started.
        number: tells the orders of generations apart: the same model may be another one by then.
    """

    recipe: str
    store: str
    beside: str | None = None
    number: str = field(default_factory=lambda: uuid.uuid4().hex)


@dataclass(frozen=True)
class Tally:
    """A tally says what became of the trajectories of a job.

    Attributes:
        made: how many were simulated and written now.
        found: how many were in the store already.
        busy: split and index of those that another process simulates, or did until it died.
    """

    made: int
    found: int
    busy: tuple[tuple[str, int], ...]


class _Worker(threading.local):
    """A worker keeps the recipe and the system that it made last, one for each thread.

    Systems are costly to build and hold a state: two threads must not step the same one.
    """

    made: tuple[Order, Recipe, System] | None = None


_worker = _Worker()


def make_trajectories(order: Order, wanted: tuple[tuple[str, int], ...]) -> Tally:
    """Make the trajectories that are wanted, by split and index, unless they are done or claimed.

    Raises:
        LoadError: the system cannot be made here.
        StoreError: this machine does not see the store, or the model is another one here.
        OSError: a trajectory cannot be written, or the disk has no locks.
    """
    path, made, found, busy = Path(order.store), 0, 0, []
    recipe, system = _prepared(order)
    for split, index in wanted:
        if is_done(path, split, index):
            found += 1
            continue
        with claimed(path, split, index) as free:
            if not free:
                busy.append((split, index))
            elif is_done(path, split, index):  # since another process had the claim
                found += 1
            else:
                _make(recipe, system, path, split, index)
                made += 1
    return Tally(made, found, tuple(busy))


def _prepared(order: Order) -> tuple[Recipe, System]:
    """Return recipe and system of an order; they are made at its first job."""
    if _worker.made is None or _worker.made[0] != order:
        if order.beside is not None:
            _require_disk(Path(order.store))
            if order.beside not in sys.path:
                sys.path.insert(0, order.beside)
        recipe = Recipe.model_validate_json(order.recipe)
        system = recipe_system(recipe)
        if order.beside is not None:  # the packages and files there may be others than those here
            where = f"the worker on {socket.gethostname()}"
            require_motion(Path(order.store), identity(recipe, system), where)
        _worker.made = order, recipe, system
    return _worker.made[1:]


def _require_disk(store: Path) -> None:
    """Refuse to work where the disk of the store is not seen."""
    end = time.monotonic() + APPEARS
    while not store.exists():
        if time.monotonic() > end:
            raise StoreError(
                f"the worker on {socket.gethostname()} does not see {str(store)!r}; expected a "
                "disk that all machines share under the same path: keep the work on such a disk "
                "(--runs FOLDER)"
            )
        time.sleep(0.5)


def _make(recipe: Recipe, system: System, path: Path, split: str, index: int) -> None:
    """Simulate a trajectory and write it; further draws take the place of one that fails."""
    stream, kinds = split_stream(recipe, split, index), recipe.drawn_for(split)
    beyond = BEYOND_ATTEMPTS if stream.beyond or leaves_ranges(recipe, stream, index) else 0
    for attempt in range(beyond + allowed_failures(recipe) + 1):
        at = attempted(stream, attempt)
        parameters = drawn_parameters(recipe, stream, index, attempt)
        try:
            driven = system_at(recipe, system, parameters)
            drawn = draw(kinds, driven, at, index, attempt)
            trajectory = simulate_draw(driven, drawn)
        except SimulationError as error:
            words = with_values(str(error), parameters)
            failure = Failure(split, index, attempt, error.time, words)
            inputs = draw_inputs(kinds, system, at, index, attempt).inputs
            keep_failure(path, failure, system, inputs)
        else:
            values = as_row(parameters) if parameters else None
            write_trajectory(path, split, index, trajectory, drawn.kind, values)
            return
