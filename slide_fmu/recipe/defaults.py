"""What a recipe leaves out gets its defaults, before any of its tables is checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import comb
from typing import Any

from slide_fmu.recipe.automatic import Tables, with_guesses
from slide_fmu.recipe.default_excitation import InputKind, default_excitation
from slide_fmu.recipe.learning import METHODS, LeastSquaresRecipe, StateSpaceRecipe
from slide_fmu.recipe.record_rules import is_measured, require_no_numbers
from slide_fmu.recipe.specimens import SPECIMENS_PER_TERM

ITERATIONS = 150
"""A training takes so many iterations on all data unless the recipe says otherwise. It converges
more slowly than without parameters: the training error of a Duffing oscillator with a mass of 1 to
3 kg falls by a factor of 2.5 from the 50th to the 150th."""

DEGREES = 2, 1
"""Of these degrees the first that the specimens suffice for is taken, or else the last."""


def with_defaults(tables: Tables) -> tuple[Tables, tuple[str, ...]]:
    """Return tables with defaults, and the keys that are left to be found, with first guesses.

    Raises:
        ValueError: a recipe of records has numbers, or the training is of another family.
    """
    if is_measured(tables):
        require_no_numbers(tables)
        tables = {"data": {}, **tables}
    guessed, open_keys = with_guesses(_with_methods(_with_excitation(tables)))
    return _with_division(_with_iterations(guessed)), open_keys


def _with_excitation(values: Tables) -> Tables:
    """Fill in the excitation that the step and the inputs ask for, where there is none."""
    data, window = values.get("data", {}), values.get("window", {})
    step = window.get("step") if isinstance(window, dict) else None
    if not isinstance(data, dict) or "excitation" in data or is_measured(values):
        return values
    if not (isinstance(step, int | float) and math.isfinite(step) and step > 0):
        return values  # the mistake in the step is told by its own check
    mix = default_excitation(float(step), _inputs_of(values.get("system")))
    return {**values, "data": {**data, "excitation": mix}}


def _inputs_of(system: Any) -> InputKind:
    """Return what the inputs are by the table ``system``, which is not checked yet."""
    if isinstance(system, dict) and system.get("chain") is not None:
        return "set_points"
    inputs = system.get("inputs") if isinstance(system, dict) else None
    tables = inputs.values() if isinstance(inputs, dict) else ()
    known = [table for table in tables if isinstance(table, dict)]
    if [table.get("angle") for table in known] == ["cosine", "sine"]:
        return "angle"
    return "moving" if any(t.get("hold") == "first_order" for t in known) else "held"


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


def _with_division(tables: Tables) -> Tables:
    """Return the tables of a recipe of specimens with its division and degree, if not given.

    Each file is divided by itself, so that every part has every specimen. The degree of the
    polynomials is one that the specimens suffice for.
    """
    data, network = tables.get("data", {}), tables.get("network", {})
    parameters = tables.get("parameters")
    known = all(isinstance(table, Mapping) for table in (parameters, data, network))
    if not (known and parameters and is_measured(tables)):
        return tables
    follows = network.get("family", StateSpaceRecipe().family) == StateSpaceRecipe().family
    degree = {"parameter_degree": _degree(parameters)} if follows else {}
    return {**tables, "data": {"by": "each", **data}, "network": {**degree, **network}}


def _degree(parameters: Mapping[str, Any]) -> int:
    """Return the degree that the values in tables, which are not checked yet, suffice for."""
    columns = [
        table.get("values", ()) for table in parameters.values() if isinstance(table, Mapping)
    ]
    different = len(set(zip(*columns, strict=False)))
    for degree in DEGREES:
        if different >= SPECIMENS_PER_TERM * comb(len(columns) + degree, degree):
            break
    return degree
