"""The features that a recipe's networks name are found without data, before any are made."""

from __future__ import annotations

from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.features.base import Features, Offered
from slide_fmu.features.sets import feature_set as set_of_names
from slide_fmu.recipe.learning import NetworkTable, StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import System


def feature_set(names: tuple[str, ...], system: System, scaling: Affine) -> Features:
    """Return the set that all names belong to, on the inputs of a system with their scaling.

    Raises:
        ValueError: names are unknown or of several sets, or the system has not what the set needs.
    """
    offered = Offered(system.inputs, scaling, system.step, system.chain)
    return set_of_names(names, offered)


def require_features(recipe: Recipe, system: System) -> None:
    """Refuse networks that see what the system has not, or turn more states than they have.

    Raises:
        RecipeError: the message has the table, and what is wrong in it.
    """
    tables: dict[str, NetworkTable] = {"network": recipe.network}
    if recipe.estimator is not None:
        tables["estimator.network"] = recipe.estimator.network
    for place, table in tables.items():
        try:
            features = feature_set(table.feature_names(), system, range_scaling(system.inputs))
            if isinstance(table, StateSpaceRecipe) and table.turned_pairs:
                drives = len(features.indices(table.drive))
                require_turned_pairs(table.turned_pairs, table.order, drives, len(system.outputs))
        except ValueError as error:
            raise RecipeError(f"recipe {recipe.name!r}: {place}: {error}") from error


def require_turned_pairs(pairs: int, order: int | str, n_drive: int, n_outputs: int) -> None:
    """Refuse to turn more pairs of states than there are, or what is no vector.

    The order may be "auto"; ``n_drive`` is the number of signals of the state input.

    Raises:
        ValueError: the message has the remedy.
    """
    if isinstance(order, int) and 2 * pairs > order:
        raise ValueError(
            f"network.turned_pairs = {pairs} with an order of {order}; expected two states "
            "for each pair: set network.order, or turn fewer pairs"
        )
    if n_drive % 3 or n_outputs % 3:
        raise ValueError(
            f"network.turned_pairs = {pairs} with {n_drive} drives and {n_outputs} outputs; "
            "expected vectors (x, y, z) of both: set turned_pairs = 0, or choose another drive"
        )
