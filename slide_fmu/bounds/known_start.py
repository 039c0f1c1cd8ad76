"""A training may begin with the network of an FMU: trained on a simulation, refined on a record.

The network keeps its features, scalings and sizes; its window is the recipe's. With an error
bound, the companion begins with the companion of the same FMU. It must not begin with the network
itself: it would share its errors.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

from slide_fmu.core.search_path import find_file
from slide_fmu.fmu.export import Provenance, read_fmu
from slide_fmu.importer.errors import FmuError
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source


def known_start(recipe: Recipe, source: Source) -> Surrogate | None:
    """Return the surrogate with which a recipe's training begins; None if it names none.

    Raises:
        RecipeError: there is no such FMU, its step, inputs, outputs or network do not fit, the
            recipe describes another network, or it has an error bound and the FMU has none.
    """
    training = recipe.training
    if not isinstance(training, LeastSquaresRecipe) or training.start is None:
        return None
    place = f"recipe {recipe.name!r}: training.start = {training.start!r}"
    _require_no_other_network(recipe, place)
    try:
        surrogate, _ = read_fmu(find_file(training.start))
    except (OSError, FmuError) as error:
        raise RecipeError(f"{place}: {error}") from error
    if not isinstance(surrogate.network, StateSpace):
        raise RecipeError(
            f"{place} has a network of another family; expected a state-space network"
        )
    if surrogate.parameters:
        raise RecipeError(
            f"{place} has the parameters {[p.name for p in surrogate.parameters]}; expected an "
            "FMU without physical parameters"
        )
    if recipe.bound is not None and surrogate.bound is None:
        raise RecipeError(
            f"{place} has no error bound; expected one, since the companion of [bound] begins "
            "with that of this FMU: remove the table [bound] and those below it, or the key"
        )
    meaning, wanted = _meaning(surrogate, surrogate.window.step), _meaning(source, source.step)
    for what, value in wanted.items():
        if meaning[what] != value:
            raise RecipeError(
                f"{place} has the {what} {meaning[what]}; expected {value}, as the recipe: give "
                "signals the same names, units and holds, and the same step, in both"
            )
    return surrogate


def companion_start(known: Surrogate) -> Surrogate:
    """Return the start of the companion: a known surrogate with its companion as its network."""
    assert known.bound is not None
    return replace(known, network=known.bound.companion, estimator=None, bound=None)


def start_origin(recipe: Recipe, known: Surrogate | None) -> Provenance:
    """Return the part of a provenance that names the FMU with which a training began, if any.

    It has the hash of its surrogate: the FMU may be written again with another runtime.
    """
    training = recipe.training
    if known is None or not isinstance(training, LeastSquaresRecipe) or training.start is None:
        return {}
    digest = hashlib.sha256(known.to_bytes()).hexdigest()
    return {"start": {"file": Path(training.start).name, "sha256": digest}}


def _require_no_other_network(recipe: Recipe, place: str) -> None:
    plain, free = StateSpaceRecipe(), {"parameter_degree"} if recipe.parameters else set()
    given = {
        key: value
        for key, value in recipe.network
        if key not in free and value != getattr(plain, key, None)
    }
    if given:
        raise RecipeError(
            f"{place} with the table network = {given}; expected none: the training goes on with "
            "the network of that FMU as it is, so remove the table"
        )


def _meaning(about: Surrogate | Source, step: float) -> dict[str, object]:
    """Return the properties that must match, by their names in messages."""
    return {
        "step": step,
        "inputs": [_properties(s.name, s.unit, s.hold, s.angle) for s in about.inputs],
        "outputs": [_properties(s.name, s.unit) for s in about.outputs],
    }


def _properties(name: str, *meaning: str | None) -> str:
    """Return the properties of a signal that must match, such as ``force: N, zero_order``."""
    return f"{name}: {', '.join(part for part in meaning if part is not None)}"
