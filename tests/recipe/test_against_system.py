"""Features that a network cannot see are refused before any data are made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.recipe.against_system import require_features
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from tests.recipes import ESTIMATOR, TINY, tiny_recipe, tiny_state_space_recipe

TRAINING = Path(__file__).parents[2] / "training"
GATED: dict[str, Any] = {
    "units": "gated",
    "drive": ["wrench_change"],
    "schedule": ["turned_inertia"],
    "turned_pairs": 2,
    "order": 6,
}
ONE_SET = (
    r"expected names of one set: inputs, changes, second_changes \(differences\); direction, "
)
ROBOT: dict[str, Any] = {
    "system": {"model": "mbs_models.robot_6r:Robot6R", "parameters": {}},
    "data": {"excitation": [{"kind": "point_to_point", "weight": 1.0}]},
}


def refused(recipe: Recipe, message: str) -> None:
    with pytest.raises(RecipeError, match=rf"^recipe 'tiny': {message}"):
        require_features(recipe, case_of(recipe).system)


def robot(**network: Any) -> Recipe:
    recipe = tiny_state_space_recipe(**ROBOT, network={**GATED, **network})
    recipe.system.parameters.pop("damping")
    recipe.system.parameters["substeps"] = 8
    return recipe


@pytest.mark.parametrize("path", sorted(TRAINING.glob("*.toml")), ids=lambda path: path.stem)
def test_the_recipes_of_this_repository_pass(path: Path) -> None:
    recipe = load_recipe(path)
    require_features(recipe, case_of(recipe).system)


def test_names_of_no_set_or_of_several_are_refused() -> None:
    refused(
        tiny_state_space_recipe(network={"drive": ["input"]}),
        r"network: features \['input'\]; " + ONE_SET,
    )
    network = {"drive": ["inputs"], "static": ["turn"]}
    refused(
        tiny_state_space_recipe(network=network),
        r"network: features \['inputs', 'turn'\]; " + ONE_SET,
    )


def test_the_network_of_the_estimator_is_looked_at_too() -> None:
    estimator = {**ESTIMATOR, "network": {**ESTIMATOR["network"], "features": ["speed"]}}
    recipe = tiny_recipe(estimator=estimator, data={"estimator": 2, "estimator_validation": 1})
    refused(recipe, r"estimator\.network: features \['speed'\]; " + ONE_SET)


def test_what_the_system_has_not_is_refused() -> None:
    refused(
        tiny_state_space_recipe(network={"drive": ["wrench"]}),
        r"network: features \['wrench'\] need a serial chain; this system has none: give it one "
        r'\(system\.chain = "robot\.urdf"\), or use other features$',
    )
    refused(
        tiny_state_space_recipe(network={"drive": ["direction"]}),
        r"network: features \['direction'\] of 1 inputs \['force'\]; expected an angle ",
    )


def test_angle_is_what_the_signals_say_and_not_their_number() -> None:
    read = load_recipe(TRAINING / "slider_crank.toml")
    network = read.network.model_copy(update={"drive": ("direction", "turn")})
    fine = read.model_copy(update={"network": network})
    system = case_of(fine).system
    require_features(fine, system)
    system.inputs = tuple(replace(signal, angle=None) for signal in system.inputs)
    with pytest.raises(RecipeError, match="expected an angle among them"):
        require_features(fine, system)


def test_pairs_turn_with_a_chain_and_have_two_states_each() -> None:
    fine = robot()
    require_features(fine, case_of(fine).system)
    require_features(robot(order="auto"), case_of(fine).system)
    refused(
        robot(order=3),
        r"network: network\.turned_pairs = 2 with an order of 3; expected two states for each "
        "pair: set network.order, or turn fewer pairs$",
    )
    refused(
        robot(drive=["rates", "position", "frame"]),
        r"network: network\.turned_pairs = 2 with 11 drives and 3 outputs; expected vectors",
    )
    network = {"units": "gated", "schedule": ["inputs"], "turned_pairs": 1}
    refused(
        tiny_state_space_recipe(network=network),
        r"network: features \['inputs', 'frame'\]; " + ONE_SET,
    )


@pytest.mark.parametrize("subcommand", ["generate", "run"])
def test_nothing_is_made_before_it_is_refused(tmp_path: Path, subcommand: str) -> None:
    recipe, runs = tmp_path / "tiny.toml", tmp_path / "runs"
    text = TINY.replace("hidden = []\nbias = false", 'hidden = []\nfeatures = ["wrench"]')
    recipe.write_text(text, encoding="utf-8")
    result = CliRunner().invoke(app, [subcommand, str(recipe), "--runs", str(runs)])
    assert result.exit_code == 1
    assert "need a serial chain" in result.output
    assert not runs.exists()
