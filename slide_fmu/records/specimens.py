"""This module finds the specimens of measured records; each file may belong to another one."""

from __future__ import annotations

from collections.abc import Iterable
from math import comb

import numpy as np

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe

SPECIMENS_PER_TERM = 2
"""Least number of specimens per polynomial term; with fewer, values between them are uncertain."""


def values_in_file(recipe: Recipe, file: int) -> dict[str, float]:
    """Return the parameters of the specimen in a file of a recipe of records, by name.

    The files are numbered from 0. The result is empty without parameters in the recipe.
    """
    return {name: table.values[file] for name, table in recipe.parameters.items()}


def specimens(recipe: Recipe) -> list[dict[str, float]]:
    """Return the different specimens in the files of a recipe of records, in their order."""
    in_files = [values_in_file(recipe, file) for file in range(1 + len(recipe.system.further))]
    return [one for index, one in enumerate(in_files) if one not in in_files[:index]]


def scarce_specimens(recipe: Recipe) -> str | None:
    """Say that the specimens only just determine the network's polynomials.

    None if they do not, or if the recipe has no parameters.
    """
    if not recipe.parameters or not isinstance(recipe.network, StateSpaceRecipe):
        return None
    degree, different = recipe.network.parameter_degree, len(specimens(recipe))
    wanted = SPECIMENS_PER_TERM * comb(len(recipe.parameters) + degree, degree)
    if different >= wanted:
        return None
    return (
        f"there are {different} specimens for polynomials of degree {degree} in "
        f"{list(recipe.parameters)}; expected at least {wanted}: between them the surrogate may "
        f"be far off; measure more specimens{_or_lower(degree)}"
    )


def _or_lower(degree: int) -> str:
    """Return the other remedy for too few specimens, if the degree can be lower."""
    return ", or set network.parameter_degree lower" if degree > 1 else ""


def too_few_specimens(recipe: Recipe, files: Iterable[int]) -> str | None:
    """Say that the specimens in some files do not determine the network's polynomials.

    File numbers start at 0. None if the specimens suffice, or if the recipe has no parameters.
    """
    parameters, network = recipe.physical(), recipe.network
    if not parameters or not isinstance(network, StateSpaceRecipe):
        return None
    rows = {tuple(values_in_file(recipe, file).values()) for file in files}
    basis = ParameterBasis.of_degree(parameters, network.parameter_degree)
    terms = len(basis.degrees)
    determined = int(np.linalg.matrix_rank(basis.values(np.array(sorted(rows), dtype=np.float64))))
    if determined == terms:
        return None
    return (
        f"parameters {list(recipe.parameters)} have {len(rows)} different values in the records "
        f"to learn from, which determine {determined} of the {terms} terms of polynomials of "
        f"degree {network.parameter_degree}; expected values that determine all: measure more "
        f"specimens{_or_lower(network.parameter_degree)}"
    )
