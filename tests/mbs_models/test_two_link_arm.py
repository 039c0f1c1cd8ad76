"""The two-link arm of the tutorial stands, in exudyn, as the chain of its URDF says."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.scaling import range_scaling
from slide_fmu.memory.bandwidth import proposed_step
from slide_fmu.recipe.against_system import require_features
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.reading import load_open_recipe
from slide_fmu.systems.base import System
from tests.marks import first

TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"
STEP = 0.01
SECOND_ORDER = 0.02
"""Deviations of 5 mm at an arm of 0.5 m: what is of second order is about 1 % of them."""


@pytest.fixture(scope="module")
def arm() -> System:
    place = str(TUTORIALS)
    if place not in sys.path:
        sys.path.append(place)
    recipe = load_open_recipe(TUTORIALS / "two_link_arm.toml").guess
    system = case_of(recipe).system
    require_features(recipe, system)
    return system


def test_base_gives_way_to_the_loads_of_the_chain(arm: System) -> None:
    """At rest: by its flexibility times the wrench, seen at the load."""
    module = sys.modules["two_link_arm"]
    recipe = load_open_recipe(TUTORIALS / "two_link_arm.toml").guess
    chain = offered_features(recipe, arm, range_scaling(arm.inputs)).chain
    assert chain is not None
    for place in ([0.0, 0.0], [2.0, 0.7], [-1.0, -0.5]):
        q, still = np.array(place), np.zeros(2)
        wrench = chain.base_wrench(q, still, still)
        wrench[2] += 3.0 * chain.gravity[2]  # of the base itself
        move = wrench / module.STIFFNESS
        expected = move[:3] + np.cross(move[3:], chain.tool_position(q))
        found = arm.simulate(np.tile(q, (20, 1)))
        assert found.shape == (21, 3)
        assert found[-1] == pytest.approx(expected, abs=SECOND_ORDER * np.abs(expected).max())


def test_arm_that_turns_evenly_throws_its_load_outwards(arm: System) -> None:
    """By the centrifugal forces of the chain, which turn with it; lying, it lifts nothing."""
    module = sys.modules["two_link_arm"]
    rate = 5.0
    inputs = np.stack([np.arange(300) * STEP * rate - 3.0, np.zeros(300)], axis=1)
    last = inputs[-1] - [STEP * rate, 0.0]  # the spline is one step late
    wrench = module.ARM.base_wrench(last, np.array([rate, 0.0]), np.zeros(2))
    wrench[2] += 3.0 * module.ARM.gravity[2]
    move = wrench / module.STIFFNESS
    expected = move[:3] + np.cross(move[3:], module.ARM.tool_position(last))
    found = arm.simulate(inputs)[-1]
    assert np.abs(found - expected).max() < 2 * SECOND_ORDER * np.abs(expected).max()


@pytest.mark.parametrize("driven", first([True, False]))
def test_step_that_is_proposed_for_an_arm_is_near_that_of_its_recipe(
    arm: System, driven: bool
) -> None:
    """The more finely noise drives it, the more it answers: only its own vibration has a step."""
    module = sys.modules[type(arm).__module__]
    found = proposed_step(lambda step: module.TwoLinkArm(step=step), driven=driven)
    assert found.own == pytest.approx(5.0, rel=0.2)
    assert found.step == STEP
