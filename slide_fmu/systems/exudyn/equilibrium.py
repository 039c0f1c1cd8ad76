"""A model of exudyn is brought to rest: by exudyn's static solver, else by letting it fall.

The static solver takes no stiffness from the weights that joints carry, and none from the mass, so
it fails for every pendulum, however well it hangs. Letting it fall from rest, again and again and
ever longer, leads to where it hangs.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.exudyn.plant import Plant

FALLS = 200
"""The model is let fall at most this number of times."""
LONGER = 2.0
"""Each fall is this number of times as long as the one before, while Newton's method converges."""
SHORTEST, LONGEST = 1e-9, 1e6
"""No fall is shorter or longer than these numbers of sample steps."""
STILL = 1e-10
"""It has come to rest where a fall moves it by less than this part of its coordinates, or of 1."""
NEAR = 1e-6
"""At rest, its forces balance within this part of its coordinates, or of 1."""
UNCERTAIN = 1e-10
"""A stiffness below this part of the largest one is taken for rounding: nothing holds there."""


def equilibrium(plant: Plant) -> FloatArray:
    """Return the coordinates of a static equilibrium near the initial configuration, SI, (n,).

    The current state of the plant stays as it is.

    Raises:
        SimulationError: none was found; the message says whether anything is free to move. Or a
            user function failed, or there are first-order coordinates, which the static solver
            leaves as they are.
    """
    if plant.mbs.systemData.ODE1Size():
        raise SimulationError("exudyn finds no equilibrium of first-order coordinates")
    try:
        return plant.static(plant.origin)
    except SimulationError as error:
        failure = error
    found = _where_it_falls(plant)
    if found is not None and _is_rest(plant, found):
        return found
    raise SimulationError(f"{failure}. {_advice(plant)}") from failure


def _where_it_falls(plant: Plant) -> FloatArray | None:
    """Return where the model comes to rest when it is let fall again and again, or None."""
    place, time, longest = plant.origin, plant.step / plant.substeps, LONGEST * plant.step
    for _ in range(FALLS):
        try:
            reached = plant.fallen(place, time)
        except SimulationError:
            longest = time = time / LONGER
            if time < SHORTEST * plant.step:
                return None
            continue
        moved = np.max(np.abs(reached - place), initial=0.0)
        place = reached
        if moved <= STILL * _size(place) and time >= longest / LONGER:
            return place
        time = min(LONGER * time, longest)
    return None


def _is_rest(plant: Plant, place: FloatArray) -> bool:
    """Return whether everything is held at coordinates, (n,), and forces balance near them."""
    linearization, forces = plant.balance(place)
    free, stiffness = _in_free_directions(linearization)
    if not _is_held(stiffness):
        return False
    away = free @ np.linalg.solve(stiffness, free.T @ forces)
    return bool(np.max(np.abs(away), initial=0.0) <= NEAR * _size(place))


def _advice(plant: Plant) -> str:
    """Say what a model without an equilibrium lacks, from what holds it where it is drawn."""
    linearization, _ = plant.balance(plant.origin)
    if _is_held(_in_free_directions(linearization)[1]):
        return (
            "Springs and supports hold every body in the initial configuration, but forces do not "
            "balance near it: begin closer to the state of rest, unless there is none"
        )
    return "Springs or supports must hold every body for there to be one"


def _in_free_directions(linearization: Linearization) -> tuple[FloatArray, FloatArray]:
    """Return unit directions that constraints leave free, (n, n_free), and the stiffness there."""
    constraints, size = linearization.constraints, len(linearization.mass)
    free = np.eye(size)
    if len(constraints):
        _, singular, right = np.linalg.svd(constraints)
        free = right[int(np.sum(singular > UNCERTAIN * singular[0])) :].T
    return free, free.T @ linearization.stiffness @ free


def _is_held(stiffness: FloatArray) -> bool:
    """Return whether a stiffness, (n_free, n_free), lets nothing move freely."""
    if not stiffness.size:
        return True
    singular = np.linalg.svd(stiffness, compute_uv=False)
    return bool(singular[-1] > UNCERTAIN * singular[0])


def _size(coordinates: FloatArray) -> float:
    """Return 1 or the largest coordinate."""
    return max(1.0, float(np.max(np.abs(coordinates), initial=0.0)))
