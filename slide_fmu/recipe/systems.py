"""The reference systems that a recipe names are made here, at the recipe's sample step."""

from __future__ import annotations

from slide_fmu.core.signals import Signal
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import System
from slide_fmu.systems.loading import load_system


def recipe_system(recipe: Recipe) -> System:
    """Return the system that makes the data of a recipe.

    Raises:
        LoadError: model, class or parameters are not there.
        RecipeError: an excitation of the recipe cannot drive the system's inputs, or the recipe
            gives the step as a parameter.
    """
    return _drivable(load_system(recipe.system.model, system_parameters(recipe)), recipe)


def reference_system(recipe: Recipe) -> System:
    """Return the system that the FMU of a recipe is measured against.

    Raises:
        LoadError: model, class or parameters are not there.
        RecipeError: as of ``recipe_system``; or signals or geometry are not those of the system
            that makes the data.
    """
    system = _drivable(load_system(recipe.system.model, reference_parameters(recipe)), recipe)
    if recipe.system.reference:
        _require_same_signals(recipe, recipe_system(recipe), system)
    return system


def _drivable(system: System, recipe: Recipe) -> System:
    """Return the system, if all excitations of the recipe can drive it."""
    for index, kind in enumerate(recipe.data.excitation):
        try:
            kind.check(system.inputs)
        except ValueError as error:
            place = f"recipe {recipe.name!r}: data.excitation.{index}"
            raise RecipeError(f"{place}: {error}") from error
    return system


def _require_same_signals(recipe: Recipe, made: System, reference: System) -> None:
    """Refuse a reference with other signals, or with outputs that mean something else."""
    for what, found, wanted in (
        ("inputs", _ranges(reference.inputs), _ranges(made.inputs)),
        ("outputs", _ranges(reference.outputs), _ranges(made.outputs)),
        ("hold and angle of the inputs", _meanings(reference.inputs), _meanings(made.inputs)),
        ("geometry of the serial chain", _geometry(reference), _geometry(made)),
    ):
        if found != wanted:
            raise RecipeError(
                f"recipe {recipe.name!r}: system.reference = {recipe.system.reference} changes "
                f"the {what} to {found}; expected, as with system.parameters, {wanted}: leave out "
                "what changes that, or give it in system.parameters too"
            )


def _ranges(signals: tuple[Signal, ...]) -> list[tuple[str, str, float, float]]:
    return [(signal.name, signal.unit, signal.low, signal.high) for signal in signals]


def _meanings(signals: tuple[Signal, ...]) -> list[tuple[str, str | None]]:
    return [(signal.hold, signal.angle) for signal in signals]


def _geometry(system: System) -> dict[str, list[float]] | None:
    """Return lengths, twists and tool point of the chain that the outputs may be about."""
    if system.chain is None:
        return None
    return {name: getattr(system.chain, name).tolist() for name in ("a", "d", "alpha", "tool")}


def system_parameters(recipe: Recipe) -> dict[str, float | int | str | bool]:
    """Return the keyword arguments of the system that makes the data.

    Raises:
        RecipeError: the recipe gives the step as a parameter.
    """
    for table in ("parameters", "reference"):
        values = getattr(recipe.system, table)
        if "step" in values:
            raise RecipeError(
                f"recipe {recipe.name!r}: system.{table}.step = {values['step']}; expected no "
                f"step there: samples are window.step = {recipe.window.step} s apart; remove it"
            )
    return {**recipe.system.parameters, "step": recipe.window.step}


def reference_parameters(recipe: Recipe) -> dict[str, float | int | str | bool]:
    """Return the keyword arguments of the system that an FMU is measured against.

    Raises:
        RecipeError: the recipe gives the step as a parameter.
    """
    return {**system_parameters(recipe), **recipe.system.reference}
