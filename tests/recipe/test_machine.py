"""A recipe gives the serial chain of a machine by its URDF, and how its joints are driven."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.robot_6r.puma_560 import puma_560
from slide_fmu.core.scaling import range_scaling
from slide_fmu.features.drive_law import DEFAULT_LAW, DRIVE_LAWS, DriveLaw
from slide_fmu.features.urdf import UrdfError
from slide_fmu.recipe.against_system import require_features
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.machine import drive_law
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.reading import load_open_recipe, parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from tests.recipes import TINY, whole_recipe
from tests.refusals import refused

REPOSITORY = Path(__file__).parents[2]
ROBOT = REPOSITORY / "training" / "robot_6r.toml"
URDF = "mbs_models/robot_6r/puma_560.urdf"


def robot(**system: Any) -> Recipe:
    values = load_open_recipe(ROBOT).guess.model_dump()
    return whole_recipe({**values, "system": {**values["system"], **system}})


def numbers(chain: object) -> list[list[float]]:
    return [np.ravel(value).tolist() for value in vars(chain).values()]


def test_chain_of_the_recipe_takes_the_place_of_the_systems_own() -> None:
    system = case_of(robot()).system
    scaling = range_scaling(system.inputs)
    own = offered_features(robot(), system, scaling)
    assert numbers(own.chain) == numbers(puma_560(np.zeros(3)))
    assert own.law == DRIVE_LAWS[DEFAULT_LAW] == DRIVE_LAWS["quadratic_b_spline"]
    moon = {"urdf": URDF, "gravity": [0.0, 0.0, -1.62], "tool": "tool"}
    read = offered_features(robot(chain=moon, drive="linear"), system, scaling)
    assert read.chain is not None
    assert read.chain.gravity.tolist() == [0.0, 0.0, -1.62]
    assert read.law == DRIVE_LAWS["linear"]


def test_path_alone_is_short_for_the_table() -> None:
    text = TINY.replace("[system]\n", '[system]\nchain = "arm.urdf"\n', 1)
    chain = parse_open_recipe(text, "mine.toml").guess.system.chain
    assert chain is not None
    assert (chain.urdf, chain.tool, chain.gravity) == ("arm.urdf", None, (0.0, 0.0, -9.81))
    recipe = parse_open_recipe(text, "mine.toml").guess
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


def test_urdf_is_found_where_models_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the current folder, or on the search path, where the recipe's own folder is."""
    recipe = robot(chain="arm.urdf")
    system = case_of(recipe).system
    scaling = range_scaling(system.inputs)
    with refused(UrdfError, "system.chain: no file 'arm.urdf' in", "or next to"):
        offered_features(recipe, system, scaling)
    text = (REPOSITORY / URDF).read_text(encoding="utf-8")
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    assert offered_features(recipe, system, scaling).chain is not None
    monkeypatch.setattr(sys, "path", sys.path[:-1])
    monkeypatch.chdir(tmp_path)
    assert offered_features(recipe, system, scaling).chain is not None


def test_inputs_that_are_no_set_points_of_the_chain_are_refused() -> None:
    text = TINY.replace("[system]\n", f'[system]\nchain = "{URDF}"\n', 1)
    recipe = parse_open_recipe(text, "mine.toml").guess
    with refused(RecipeError, "has the joints ['joint_1'", "found ['force'] in"):
        require_features(recipe, case_of(recipe).system)


def test_weights_of_a_law_may_be_given() -> None:
    weights = {
        "position": (0.25, 0.5, 0.25),
        "rate": (0.5, 0.0, -0.5),
        "acceleration": (1.0, -2.0, 1.0),
    }
    assert drive_law(robot(drive=tuple(weights.values())).system.drive) == DriveLaw(**weights)


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        ('"spline"', r"system\.drive = 'spline': expected one of \['linear', 'quadratic_b_spl"),
        ("[[1, 0, 0], [1, 0, 0], [1, -2, 1]]", "rests where"),
        ("[[1, 0, 0]]", r"^mine\.toml: system\.drive.*three lists of three weights"),
        ("{ position = [1, 0, 0] }", r"^mine\.toml: system\.drive.*three lists of three weights"),
    ],
)
def test_drives_that_are_no_law_are_refused(drive: str, message: str) -> None:
    text = TINY.replace("[system]\n", f"[system]\ndrive = {drive}\n", 1)
    with pytest.raises(RecipeError, match=message):
        parse_open_recipe(text, "mine.toml")
