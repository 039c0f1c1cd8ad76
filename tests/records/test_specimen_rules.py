"""Recipes of several specimens: which values they have, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from slide_fmu.core.parameters import Parameter
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.specimens import specimens, too_few_specimens, values_in_file
from tests.own_records import RECIPE
from tests.recipes import tiny_state_space_recipe
from tests.refusals import refused

FILES = 'model = "a.csv"\nfurther = ["b.csv", "c.csv", "d.csv"]'
MASSES = "[1.0, 3.0, 2.0, 3.0]"


def recipe_of(mass: str = f"values = {MASSES}", more: str = "", degree: int = 0) -> Recipe:
    text = RECIPE.replace('model = "bench.csv"', FILES)
    if degree:
        text = text.replace("hidden = 4", f"hidden = 4\nparameter_degree = {degree}")
    return parse_open_recipe(
        f'{text}\n[parameters.mass]\nunit = "kg"\n{mass}\n{more}', "recipe"
    ).guess


def test_parameter_ranges_over_the_values_in_the_files() -> None:
    recipe = recipe_of('values = [1.0, 3.0, 2.0, 3.0]\ntransform = "log"')
    assert recipe.physical() == (Parameter("mass", "kg", 1.0, 3.0, transform="log"),)
    assert values_in_file(recipe, 2) == {"mass": 2.0}
    assert specimens(recipe) == [{"mass": 1.0}, {"mass": 3.0}, {"mass": 2.0}]
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


def test_each_file_is_divided_by_itself_if_nothing_is_said() -> None:
    assert recipe_of().data.by == "each"
    assert recipe_of(more='[data]\nby = "record"').data.by == "record"
    assert parse_open_recipe(RECIPE, "recipe").guess.data.by == "block"


def test_few_specimens_do_not_determine_a_polynomial() -> None:
    recipe = recipe_of(degree=2)
    assert too_few_specimens(recipe, [0, 1, 2]) is None
    problem = too_few_specimens(recipe, [1, 2, 3])
    assert problem is not None
    assert "2 different values" in problem
    assert "2 of the 3 terms of polynomials of degree 2" in problem
    assert problem.endswith("measure more specimens, or set network.parameter_degree lower")
    low = recipe.network.model_copy(update={"parameter_degree": 1})
    linear = recipe.model_copy(update={"network": low})
    assert too_few_specimens(linear, [1, 2, 3]) is None
    alone = too_few_specimens(linear, [1])
    assert alone is not None
    assert alone.endswith("measure more specimens")  # no degree is lower


def test_feed_forward_network_of_specimens_is_refused_for_what_it_is() -> None:
    tables = '[network]\nfamily = "feed_forward"\nhidden = [8]\n'
    text = RECIPE.replace('model = "bench.csv"', FILES)
    text = text[: text.index("[network]")] + tables
    with refused(ValueError, "state-space networks"):
        parse_open_recipe(f"{text}\n[training]\nsteps=5\nbatch=5\nlearning_rate=1e-3\n"
                     f"[parameters.mass]\nvalues = {MASSES}", "recipe")  # fmt: skip


@pytest.mark.parametrize(
    ("mass", "message"),
    [
        ("values = [1.0, 2.0, 3.0]", "expected 4 of them, one for each file"),
        (f"range = [1.0, 3.0]\nvalues = {MASSES}", "the values in the files"),
        ("range = [1.0, 3.0]", "expected 4 of them, .* remove the range"),
        ("values = [2.0, 2.0, 2.0, 2.0]", "expected at least two that differ"),
        (f"values = {MASSES}\nstart = 4.0", "start 4.0; expected a value within its range"),
        ("", "range = None, values = "),
    ],
)
def test_values_that_do_not_fit_are_refused(mass: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        recipe_of(mass)


def test_degree_is_one_that_the_specimens_suffice_for() -> None:
    assert network_of(recipe_of()).parameter_degree == 1
    six = '["b.csv", "c.csv", "d.csv", "e.csv", "f.csv"]'
    text = RECIPE.replace('model = "bench.csv"', f'model = "a.csv"\nfurther = {six}')
    recipe = parse_open_recipe(
        f"{text}\n[parameters.mass]\nvalues = [1, 2, 3, 4, 5, 6]", "recipe"
    ).guess
    assert network_of(recipe).parameter_degree == 2
    assert network_of(recipe_of(degree=2)).parameter_degree == 2


def network_of(recipe: Recipe) -> StateSpaceRecipe:
    assert isinstance(recipe.network, StateSpaceRecipe)
    return recipe.network


def test_two_parameters_that_go_together_are_not_told_apart() -> None:
    """Every heavy specimen is a stiff one: five files determine two of three terms."""
    text = RECIPE.replace('model = "bench.csv"', FILES.replace('"d.csv"', '"d.csv", "e.csv"'))
    values = [1.0, 1.5, 2.0, 2.5, 3.0]
    tables = [f"[parameters.{name}]\nvalues = {values}\n" for name in ("mass", "stiffness")]
    with refused(ValueError, "5 different values", "2 of the", "determine 2"):
        parse_open_recipe("\n".join([text, *tables]), "recipe")


def test_models_have_no_values_in_files() -> None:
    mass: dict[str, Any] = {"values": [1.0, 2.0], "unit": "kg"}
    with refused(ValueError, "measured records"):
        tiny_state_space_recipe(parameters={"mass": mass})
