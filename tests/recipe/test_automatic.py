"""What a recipe leaves to be found is guessed, named, and replaced once."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.recipe.recipe import RecipeError
from tests.recipes import ESTIMATOR, TINY, merged, tiny_recipe
from tests.refusals import refused

FOUND: dict[str, dict[str, Any]] = {
    "window": {"n_in": 48, "n_out": 8},
    "data": {"duration": 2.0, "burn_in": 0.25},
}
"""What the tiny recipe gives."""
KEYS = ("window.n_in", "window.n_out", "data.duration", "data.burn_in")


def open_recipe(**changes: Any) -> OpenRecipe:
    """The tiny recipe with all that can be found left out, and changes of it."""
    tables = tomllib.loads(TINY)
    for table, values in FOUND.items():
        for key in values:
            del tables[table][key]
    return OpenRecipe.of(merged(tables, changes), "it")


def test_keys_that_are_left_out_or_auto_are_automatic() -> None:
    assert open_recipe().open_keys == KEYS
    assert open_recipe(window={"n_out": "auto"}).open_keys == KEYS
    assert open_recipe(window={"n_in": 40}, data={"burn_in": 1.0}).open_keys == KEYS[1:3]
    with refused(RecipeError, "leaves window.n_in", "to be found"):
        open_recipe().resolved()


@pytest.mark.parametrize("given", [{"n_in": 2}, {"n_out": 500}, {"n_in": 1}, {}])
def test_guesses_are_a_window(given: dict[str, int]) -> None:
    recipe = open_recipe(window=given).guess
    window = recipe.window
    assert 1 <= window.n_out <= window.n_in
    assert given.items() <= window.model_dump().items()
    assert recipe.data.burn_in == recipe.data.duration == window.step * window.n_in


def test_what_is_given_need_not_agree_with_guesses() -> None:
    """Lags and durations that a long window would not allow, and a short one does."""
    estimator = {**ESTIMATOR, "network": {**ESTIMATOR["network"], "time_invariant": True}}
    changes = {
        "data": {"duration": 0.5, "estimator": 2, "estimator_validation": 1},
        "estimator": {**estimator, "expert": {"lags": [0, 200]}},
    }
    assert open_recipe(**changes).open_keys == (*KEYS[:2], KEYS[3])
    with refused(RecipeError, "expected at most", "estimator.expert.lags end"):
        open_recipe(**changes).with_found(
            {"window": FOUND["window"], "data": {"burn_in": 0.0}}, "it"
        )


def test_resolved_recipe_is_the_one_that_gives_the_values() -> None:
    assert open_recipe().with_found(FOUND, "it").resolved() == tiny_recipe()
    part = open_recipe().with_found({"window": FOUND["window"]}, "it")
    assert part.open_keys == KEYS[2:]
    assert part.with_found({"data": FOUND["data"]}, "it").resolved() == tiny_recipe()


def test_values_for_what_is_given_are_refused() -> None:
    with refused(RecipeError, "for ['window.n_in']"):
        OpenRecipe(tiny_recipe(), ()).with_found({"window": {"n_in": 48}}, "it")


def test_values_that_do_not_fit_what_is_given_are_refused() -> None:
    recipe = open_recipe(data={"duration": 0.5})
    found = {"window": FOUND["window"], "data": {"burn_in": 0.25}}
    with refused(RecipeError, "it", "data.duration = 0.5", "expected at least 0.75"):
        recipe.with_found(found, "it")


def test_window_without_a_step_is_a_mistake_of_the_step_alone() -> None:
    text = TINY.replace("step = 0.015625\n", "").replace("n_in = 48\nn_out = 8\n", "")
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text, "it")
    assert str(caught.value) == "it: window.step is missing"


@pytest.mark.parametrize("window", ["step = 0.0", "stp = 0.1", 'step = "fine"'])
def test_mistake_in_the_step_is_not_told_of_the_excitation_too(window: str) -> None:
    text = 'name = "it"\ndescription = "it"\n[system]\nmodel = "m:M"\n[window]\n'
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text + window, "it")
    assert "it: window.st" in str(caught.value)
    assert "data" not in str(caught.value)
