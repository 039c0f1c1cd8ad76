"""What a recipe leaves out gets its defaults, before any of its tables is checked."""

from __future__ import annotations

from collections.abc import Mapping

from slide_fmu.recipe.automatic import Tables, with_guesses
from slide_fmu.recipe.learning import METHODS, LeastSquaresRecipe
from slide_fmu.recipe.model_rules import rules_of_tables

ITERATIONS = 150
"""A training takes so many iterations on all data unless the recipe says otherwise. It converges
more slowly than without parameters: the training error of a Duffing oscillator with a mass of 1 to
3 kg falls by a factor of 2.5 from the 50th to the 150th."""


def with_defaults(tables: Tables) -> tuple[Tables, tuple[str, ...]]:
    """Return tables with defaults, and the keys that are left to be found, with first guesses.

    Raises:
        ValueError: a recipe of records has numbers, or the training is of another family.
    """
    rules = rules_of_tables(tables)
    guessed, open_keys = with_guesses(_with_methods(rules.begun(tables)))
    return rules.ended(_with_iterations(guessed)), open_keys


def _with_methods(values: Tables) -> Tables:
    """Fill in the family of the network, whose name is short for its table, and its training."""
    network, training = values.get("network", {}), values.get("training", {})
    if isinstance(network, str):
        network = {"family": network}
    if not isinstance(network, dict):  # one mistake, not those of the training too
        return {**values, "training": LeastSquaresRecipe()}
    if not isinstance(training, dict):
        return {**values, "network": {"family": "state_space", **network}}
    network = {"family": "state_space", **network}
    method = METHODS.get(str(network["family"]))
    if method is None:
        return {**values, "network": network, "training": LeastSquaresRecipe()}
    given = training.get("method", method)
    if given != method:
        raise ValueError(
            f"training.method = {given!r}; expected {method!r} for network.family = "
            f"{network['family']!r}"
        )
    return {**values, "network": network, "training": {"method": method, **training}}


def _with_iterations(tables: Tables) -> Tables:
    """Return the tables of a recipe with as many iterations as parameters need, if not given."""
    training = tables.get("training", {})
    if not tables.get("parameters") or not isinstance(training, Mapping):
        return tables
    method = training.get("method", LeastSquaresRecipe().method)
    if "iterations" in training or method != LeastSquaresRecipe().method:
        return tables
    return {**tables, "training": {**training, "iterations": ITERATIONS}}
