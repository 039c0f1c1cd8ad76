"""What can be found wrong with a recipe without data is refused before any are made."""

from __future__ import annotations

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import PROBE, PROBE_SAMPLES, Stream, draw
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import recipe_system, reference_system, require_features
from slide_fmu.systems.base import System
from slide_fmu.systems.contract import check_system


def check_recipe(recipe: Recipe) -> None:
    """Refuse what can be found wrong without data, before any are made.

    Raises:
        LoadError: one of the recipe's systems cannot be made.
        RecipeError: they do not fit each other or the excitation, or a network sees what the
            system has not.
        ContractError: the system that makes the data does not keep its word.
        SimulationError: it could not be simulated on a short record, or its library crashes.
    """
    reference_system(recipe)
    system = recipe_system(recipe)
    require_features(recipe, system)
    if system.may_crash and recipe not in _survived:
        from slide_fmu.data.generation import require_survival

        require_survival(recipe)
        _survived[:] = [recipe]
    inputs = _some_inputs(recipe, system)
    check_system(system, recipe.window.step, inputs, recipe.system.model)


_survived: list[Recipe] = []
"""The recipe whose system was last simulated without a crash."""


def _some_inputs(recipe: Recipe, system: System) -> FloatArray:
    """Draw a short record of the recipe's inputs, (PROBE_SAMPLES, n_inputs)."""
    duration = PROBE_SAMPLES * recipe.window.step
    stream = Stream(PROBE, recipe.data.seed, (1.0, 1.0), duration)
    return draw(recipe, system, stream, 0).inputs[:PROBE_SAMPLES]
