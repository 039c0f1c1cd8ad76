"""What a fit is given of a recipe's physical parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.data.store import Split
from slide_fmu.features.base import Offered
from slide_fmu.fitting.feature_search import choices
from slide_fmu.fitting.problem import Physical
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe, RecipeError


def physical_of(
    recipe: Recipe, splits: Sequence[Split], corners: Sequence[NDArray[np.complex128] | None]
) -> Physical | None:
    """Return the parameters of trajectories; None where the recipe has none.

    Args:
        recipe: one with a state-space network, if it has parameters.
        splits: those to learn from, to validate by, and perhaps those beyond the range.
        corners: eigenvalues in 1/s of the system at the corners of the parameters' box; None
            where they are not known.
    """
    parameters = recipe.physical()
    if not parameters:
        return None
    assert isinstance(recipe.network, StateSpaceRecipe)
    basis = ParameterBasis.of_degree(parameters, recipe.network.parameter_degree)
    training, validation, *beyond = (split.parameters for split in splits)
    assert training is not None
    assert validation is not None
    known = [values for values in corners if values is not None]
    eigenvalues = np.concatenate(known) if known and len(known) == len(corners) else None
    return Physical(basis, training, validation, beyond[0] if beyond else None, eigenvalues)


def require_chosen_features(recipe: Recipe, offered: Offered, n_outputs: int) -> None:
    """Refuse to search for the features of a network with parameters: the search knows none.

    Raises:
        RecipeError: the recipe leaves the features open, and there are several choices.
    """
    network = recipe.network
    if not recipe.parameters or not isinstance(network, StateSpaceRecipe):
        return
    if len(choices(network, offered, n_outputs)) > 1:
        raise RecipeError(
            f"recipe {recipe.name!r}: network.drive is left open, with parameters "
            f"{list(recipe.parameters)}; expected names of features, since those that are tried "
            "know no parameters: name them (network.drive)"
        )
