"""Recipes that declare physical parameters: what they mean, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slide_fmu.core.parameters import Parameter
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.open_recipe import ITERATIONS
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.simulation import simulate
from tests.recipes import tiny_recipe, tiny_state_space_recipe
from tests.refusals import refused
from tests.systems.function_models.specifications import HERE

MASS: dict[str, Any] = {"range": [1.0, 4.0], "unit": "kg", "transform": "log"}


def with_mass(**changes: Any) -> Recipe:
    return tiny_state_space_recipe(**{"parameters": {"mass": MASS}, **changes})


def test_recipe_without_parameters_has_none() -> None:
    recipe = tiny_recipe()
    assert recipe.physical() == ()
    assert recipe.training.model_dump() == tiny_recipe().training.model_dump()


def test_tables_are_parameters_in_their_order() -> None:
    recipe = with_mass(
        parameters={"mass": MASS, "stiffness": {"range": [900, 1700], "start": 1e3}}
    )
    mass, stiffness = recipe.physical()
    assert mass == Parameter("mass", "kg", 1.0, 4.0, transform="log")
    assert stiffness == Parameter("stiffness", "1", 900.0, 1700.0, start=1000.0)


def test_system_has_the_start_values() -> None:
    recipe = with_mass(system={"reference": {"substeps": 12}})
    for specification in (
        case_of(recipe).systems.specification,
        case_of(recipe).systems.reference_specification,
    ):
        assert specification.parameters["mass"] == pytest.approx(2.0)
        assert specification.parameters["damping"] == 40.0


def test_recipe_at_values_is_a_recipe_of_a_fixed_system() -> None:
    recipe = with_mass()
    heavy = recipe.at({"mass": 4.2})
    assert heavy.physical() == ()
    assert case_of(heavy).systems.specification.parameters["mass"] == 4.2
    assert case_of(heavy).system.inputs == case_of(recipe).system.inputs
    assert heavy.model_dump(exclude={"system", "parameters"}) == recipe.model_dump(
        exclude={"system", "parameters"}
    )


def test_training_takes_more_iterations_unless_they_are_given() -> None:
    assert with_mass().training.iterations == ITERATIONS  # type: ignore[union-attr]
    given = with_mass(training={"iterations": 7})
    assert given.training.iterations == 7  # type: ignore[union-attr]
    assert tiny_state_space_recipe().training.iterations == 60  # type: ignore[union-attr]


def test_recipe_is_the_same_after_json() -> None:
    recipe = with_mass()
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameters": {"mass": {**MASS, "range": [4.0, 1.0]}}}, r"range \[4.0, 1.0\] kg"),
        ({"parameters": {"mass": {**MASS, "start": 5.0}}}, "start 5.0; expected a value within"),
        ({"parameters": {"mass": {**MASS, "transform": "root"}}}, "transform"),
        ({"parameters": {"mass": {**MASS, "limits": 1}}}, "limits"),
        ({"parameters": {"mass": {**MASS, "beyond": -0.1}}}, "beyond"),
        ({"parameters": {"mass": {**MASS, "beyond": float("nan")}}}, "beyond"),
        (
            {"parameters": {"mass": {"values": [1.0, 2.0], "beyond": 0.05}}},
            "nothing is known of what lies beyond measured records",
        ),
        ({"parameters": {"step": MASS}}, "the sample step of a surrogate is window.step"),
        ({"system": {"parameters": {"mass": 1.0}}}, "mass is in system.parameters too"),
        ({"system": {"reference": {"mass": 1.0}}}, "mass is in system.reference too"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        with_mass(**changes)


def test_feed_forward_networks_follow_no_parameters() -> None:
    with refused(ValueError, "state-space networks alone follow them"):
        tiny_recipe(parameters={"mass": MASS})


FUNCTION = f"""
name = "lag"
description = "a function with a parameter"

[system]
kind = "function"
model = "{HERE / "first_order_lag.py"}"

[parameters.NAME]
range = [0.1, 0.4]
unit = "s"
transform = "log"

[window]
step = 0.05
n_in = 96
n_out = 32

[data]
train = 2
validation = 1
"""


def test_parameters_are_those_of_functions_too() -> None:
    recipe = parse_open_recipe(FUNCTION.replace("NAME", "time_constant"), "recipe").guess
    assert [parameter.start_value for parameter in recipe.physical()] == pytest.approx([0.2])
    step = np.ones((10, 1))
    step[0] = 0.0  # it begins at rest under its first input
    slow, quick = (
        simulate(case_of(recipe.at({"time_constant": time})).system, step, None).outputs[1:, 0]
        for time in (0.4, 0.1)
    )
    assert np.all(slow[1:] < quick[1:])


def test_parameter_that_the_model_has_not_is_refused() -> None:
    recipe = parse_open_recipe(FUNCTION.replace("NAME", "mass"), "recipe").guess
    with refused(LoadError, "mass"):
        _ = case_of(recipe).system
    with refused(LoadError, "mass"):
        _ = case_of(tiny_state_space_recipe(parameters={"weight_of_mass": MASS})).system
