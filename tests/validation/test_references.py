"""The finer model of a recipe has the signals and geometry of the model of the data."""

from __future__ import annotations

import re
from typing import Any

import pytest

from slide_fmu.pipeline.case_checks import check_case
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.errors import LoadError
from tests.recipes import tiny_recipe
from tests.refusals import refused


def reference_refused(**system: Any) -> str:
    """Return the message about a reference, which comes before data and before a validation."""
    case = case_of(tiny_recipe(system=system))
    with pytest.raises(RecipeError) as caught:
        _ = case.reference
    with pytest.raises(RecipeError, match=re.escape(str(caught.value))):
        check_case(case)
    return str(caught.value)


def test_reference_with_other_signals_is_refused() -> None:
    said = reference_refused(reference={"force_limit": 1.0})
    assert "recipe 'tiny': system.reference = {'force_limit': 1.0} changes the inputs to [" in said
    assert "expected, as with system.parameters, [('force', 'N', -2000.0, 2000.0)]: " in said
    said = reference_refused(reference={"position_limit": 9.0})
    assert "changes the outputs to [('position', 'm', -9.0, 9.0)]; expected, as with" in said
    with refused(LoadError, "unknown parameters ['substep']"):
        _ = case_of(tiny_recipe(system={"reference": {"substep": 3}})).reference


def test_reference_with_another_tool_is_refused() -> None:
    """Its outputs have the same names, units and ranges, but they are about another point."""
    move = {"kind": "point_to_point", "weight": 1.0}
    model = {"model": "mbs_models.robot_6r:Robot6R", "parameters": {"tool_length": 0.1}}
    data = {"excitation": [move]}
    robot = tiny_recipe(system=model, data=data)
    robot.system.parameters.pop("damping")
    robot.system.reference["authors_gains"] = True
    assert case_of(robot).reference.chain is not None
    robot.system.reference["tool_length"] = 0.2
    with refused(RecipeError, "serial chain", "0.2]"):
        _ = case_of(robot).reference


@pytest.mark.parametrize("table", ["parameters", "reference"])
def test_recipe_with_a_step_of_its_own_for_the_system_is_refused(table: str) -> None:
    said = reference_refused(**{table: {"step": 1.0}})
    assert said == (
        f"recipe 'tiny': system.{table}.step = 1.0; expected no step there: samples are "
        "window.step = 0.015625 s apart; remove it"
    )
