"""What is done with the system of a recipe tells its mistakes with the recipe's name."""

from __future__ import annotations

import pytest

from slide_fmu.memory.modes import UnstableModeError
from slide_fmu.pipeline.checks import guarded_recipe, require_names_in_fmu
from slide_fmu.recipe.parameters import ParameterRecipe
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


@pytest.mark.parametrize("name", ["window_filled", "time", "initial_force", "force"])
def test_parameter_whose_name_the_fmu_needs_is_refused_before_any_data(name: str) -> None:
    parameters = {name: ParameterRecipe(range=(1.0, 2.0))}
    recipe = tiny_recipe().model_copy(update={"parameters": parameters})
    with pytest.raises(RecipeError, match=rf"parameter '{name}'.*rename the signal or"):
        require_names_in_fmu(recipe, recipe_system(tiny_recipe()))


def test_names_of_a_usual_recipe_are_free() -> None:
    recipe = tiny_recipe()
    require_names_in_fmu(recipe, recipe_system(recipe))
