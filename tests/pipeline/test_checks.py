"""What is done with the system of a recipe tells its mistakes with the recipe's name."""

from __future__ import annotations

import pytest

from slide_fmu.memory.modes import UnstableModeError
from slide_fmu.pipeline.checks import guarded_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.recipe.systems import recipe_system
from tests.recipes import tiny_recipe


def fail(recipe: Recipe, kind: type[ValueError]) -> None:
    raise kind("decay time = inf s")


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (ValueError, r"^recipe 'NAME': decay time = inf s$"),
        (UnstableModeError, r"^recipe 'NAME': decay time = inf s$"),
        (RecipeError, r"^decay time = inf s$"),  # it has named its place already
    ],
)
def test_mistake_that_knows_no_recipe_is_told_with_its_name(
    kind: type[ValueError], message: str
) -> None:
    recipe = tiny_recipe()
    with pytest.raises(kind, match=message.replace("NAME", recipe.name)):
        guarded_recipe(recipe, recipe_system(recipe), fail, kind)
