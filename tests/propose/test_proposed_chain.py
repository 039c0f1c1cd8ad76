"""Inputs that are set points of a robot get motions from point to point, and its chain."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.features.urdf import UrdfError
from slide_fmu.propose.proposal import InitOptions, Proposal, propose
from slide_fmu.recipe.against_system import require_features
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from tests.progress import silent
from tests.refusals import refused

DRIVEN = {"point_to_point", "axis_moves"}
"""Kinds of excitation of set points and angles."""
TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"
TURNING = '''
"""A crank that follows its set point; its unit is UNIT."""

inputs = {"crank": {"unit": "UNIT", "range": [-2.0, 2.0]}}
outputs = {"angle": "rad"}
start = [0.0]


def f(x, u, p):
    return [(u[0] - x[0]) / 0.1]


def g(x, u, p):
    return [x[0]]
'''


@pytest.fixture
def arm(brief: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the two-link arm with its URDF."""
    monkeypatch.chdir(tmp_path)
    for name in ("two_link_arm.py", "two_link_arm.urdf"):
        shutil.copy(TUTORIALS / name, tmp_path)
    return tmp_path


def proposed(chain: str | None = None, model: str = "two_link_arm.py") -> tuple[Proposal, Recipe]:
    options = InitOptions(
        model, step=0.01, folder=Path("recipes"), chain=None if chain is None else Path(chain)
    )
    proposal = propose(options, silent)
    return proposal, parse_open_recipe(proposal.text, "proposal").guess


def kinds(recipe: Recipe) -> set[str]:
    return {kind.kind for kind in recipe.data.excitation}


def test_robot_beside_its_urdf_gets_chain_drive_and_motions(arm: Path) -> None:
    proposal, recipe = proposed()
    assert recipe.system.chain is not None
    assert recipe.system.chain.urdf == "../two_link_arm.urdf"
    assert kinds(recipe) == DRIVEN
    assert recipe.stability.amplitudes == (1.0, 1.5, 2.0)
    assert any("lies next to the model" in remark for remark in proposal.remarks)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(arm / "recipes"))
        (arm / "recipes").mkdir()
        require_features(recipe, case_of(recipe).system)
    # limits in the inputs' own units: a range of 6 rad and one of 2 rad, each in 2 s
    assert 'drive = "quadratic_b_spline"' in proposal.text
    assert "speed = [3.0, 1.0]" in proposal.text
    assert "acceleration = [12.0, 4.0]" in proposal.text


def test_urdf_that_is_named_is_taken_from_anywhere(arm: Path) -> None:
    (arm / "robots").mkdir()
    shutil.move("two_link_arm.urdf", "robots/arm.urdf")
    shutil.copy(TUTORIALS / "two_link_arm.urdf", arm / "two_link_arm.urdf")
    _, recipe = proposed("robots/arm.urdf")
    assert recipe.system.chain is not None
    assert recipe.system.chain.urdf == "../robots/arm.urdf"
    command = ("init", "two_link_arm.py", "--step", "0.01", "--chain", "robots/arm.urdf")
    done = CliRunner().invoke(app, list(command))
    assert done.exit_code == 0, done.output
    assert 'chain = "robots/arm.urdf"' in (arm / "two_link_arm.toml").read_text()


def test_urdf_that_does_not_fit_is_refused_where_it_is_named(arm: Path) -> None:
    (arm / "crank.py").write_text(TURNING.replace("UNIT", "rad"))
    expected = (
        r"--chain two_link_arm.urdf: its joints are \['turn', 'lift'\]; expected their set points "
        r"as inputs, in this order and in \['rad', 'rad'\], found \['crank'\] in \['rad'\]"
    )
    with pytest.raises(RecipeError, match=expected):
        proposed("two_link_arm.urdf", "crank.py")
    (arm / "broken.urdf").write_text("<robot")
    with refused(UrdfError, "cannot be read as URDF"):
        proposed("broken.urdf")


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("rad", DRIVEN), ("deg", DRIVEN), ("N", None)],
)
def test_angles_without_a_urdf_that_fits_are_set_points_too(
    unit: str, expected: set[str] | None, arm: Path
) -> None:
    (arm / "crank.py").write_text(TURNING.replace("UNIT", unit))
    proposal, recipe = proposed(model="crank.py")
    assert recipe.system.chain is None
    assert any("two_link_arm.urdf next to the model is not used" in r for r in proposal.remarks)
    low, high = recipe.system.outputs["angle"].range or (0.0, 0.0)
    assert -3.0 < low < 0.0 < high < 3.0
    if expected is None:
        assert {"multisine", "held_random"} < kinds(recipe)
    else:
        assert kinds(recipe) == expected


def test_several_urdfs_beside_a_model_are_left_to_the_user(arm: Path) -> None:
    shutil.copy(arm / "two_link_arm.urdf", arm / "other.urdf")
    proposal, recipe = proposed()
    assert recipe.system.chain is None
    assert kinds(recipe) == DRIVEN  # its inputs are angles
    assert any("['other.urdf', 'two_link_arm.urdf']" in remark for remark in proposal.remarks)


def test_model_with_a_chain_of_its_own_has_set_points(arm: Path) -> None:
    _, recipe = proposed(model="mbs_models.robot_6r:Robot6R")
    assert recipe.system.chain is None
    assert kinds(recipe) == DRIVEN
