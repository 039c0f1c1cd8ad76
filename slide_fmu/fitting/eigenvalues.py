"""Eigenvalues of a linearized system, from which linear models start and poles are judged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.parameters import corners_of
from slide_fmu.memory.modes import spectrum
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import recipe_source
from slide_fmu.systems.base import Linearizable, Source, System


def eigenvalues_at_rest(system: Source) -> NDArray[np.complex128] | None:
    """Return the eigenvalues in 1/s of the system linearized at rest under its start inputs.

    There is one of each conjugate pair, and none of rigid-body modes; None of a system that does
    not offer to be linearized.

    Raises:
        UnstableModeError: a mode grows.
    """
    if not isinstance(system, Linearizable):
        return None
    start = np.array([signal.start_value for signal in system.inputs])
    found = spectrum(system.linearize(system.rest_state(start)))
    return np.array([mode.eigenvalue for mode in found.modes], dtype=np.complex128)


def eigenvalues_at_corners(recipe: Recipe, source: Source) -> list[NDArray[np.complex128] | None]:
    """Return what ``eigenvalues_at_rest`` gives at all corners of the parameters' box.

    There are none where the recipe has no parameters, or the source cannot be set, as records.

    Raises:
        UnstableModeError: a mode grows at a corner.
    """
    if not (recipe.parameters and isinstance(source, System)):
        return []
    corners = corners_of(recipe.physical())
    return [eigenvalues_at_rest(recipe_source(recipe.at(corner))) for corner in corners]
