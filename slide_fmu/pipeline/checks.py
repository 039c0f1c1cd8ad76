"""What can be found wrong with a recipe without data is refused before any are made."""

from __future__ import annotations

from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import recipe_system, reference_system, require_features


def check_recipe(recipe: Recipe) -> None:
    """Refuse what can be found wrong without data, before any are made.

    Raises:
        LoadError: one of the recipe's systems cannot be made.
        RecipeError: they do not fit each other or the excitation, or a network sees what the
            system has not.
        SimulationError: a library of somebody else crashes, or cannot simulate a short motion.
    """
    reference_system(recipe)
    system = recipe_system(recipe)
    require_features(recipe, system)
    if system.may_crash and recipe not in _survived:
        from slide_fmu.data.generation import require_survival

        require_survival(recipe)
        _survived[:] = [recipe]


_survived: list[Recipe] = []
"""The recipe whose system was last simulated without a crash."""
