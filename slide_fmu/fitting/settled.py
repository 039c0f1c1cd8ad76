"""Networks of mixed units are settled: cubes get less room where they do not forget far beyond.

Clipped cubes go on as cubes beyond the range (``slide_fmu.fitting.state_space.cubes``). The more
room they have, the steeper they get, and a network whose cubes are too steep does not forget its
state at large amplitudes. With half the room it answers to the bit as before within the range.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.fitting.state_space.cubes import with_half_the_room
from slide_fmu.memory.stability import check_stability, excited_features
from slide_fmu.network.state_space.cell import MIXED_UNITS
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source


def settled(surrogate: Surrogate, recipe: Recipe, system: Source) -> Surrogate:
    """Return a surrogate that passes the test of stability, if less room for its cubes brings it.

    It stays as it is if it passes with all its room, or if less does not help or would change
    what it answers within the range.
    """
    network = surrogate.network
    if not isinstance(network, StateSpace) or network.cell.activation != MIXED_UNITS:
        return surrogate
    if _is_stable(surrogate, recipe, system):
        return surrogate
    smaller = with_half_the_room(network)
    features = excited_features(surrogate, recipe, system, 1.0)
    if not np.array_equal(network.run(features)[0], smaller.run(features)[0]):
        return surrogate
    other = replace(surrogate, network=smaller)
    return other if _is_stable(other, recipe, system) else surrogate


def _is_stable(surrogate: Surrogate, recipe: Recipe, system: Source) -> bool:
    return all(test.problem is None for test in check_stability(surrogate, recipe, system))
