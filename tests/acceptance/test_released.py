"""The released FMUs: whole, made from the recipes that are here, and as accurate as they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from fmus.table import row_of
from slide_fmu.cosim.check import check_fmu
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.measurement import released_case, validate_fmu_file
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.report.row_tables import card_table
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.table import markdown
from slide_fmu.validation.task import Task
from tests.acceptance.conftest import invoke
from tests.marks import essential

ROOT = Path(__file__).parents[2]
RELEASED = {
    "linear": 1e-6,
    "linear_10ms": 1e-6,
    "duffing": 0.0015,
    "duffing_10ms": 0.0015,
    "mass_chain": 0.02,
    "mass_chain_10ms": 0.02,
    "slider_crank": 0.005,
    "slider_crank_20ms": 0.005,
    "slider_crank_payload": 0.005,
    "robot_6r": 0.009,
}
"""Released FMUs and the relative RMSE that their recipes promise."""

FEW = Task(trajectories=4, seed=424_242, duration=30.0)
"""Enough trajectories to tell the promised accuracy from a broken FMU."""

AT_REST = 515_151
"""Seed of motions that come to rest."""


def released(name: str) -> Path:
    """Path of a released FMU."""
    return ROOT / "fmus" / name / f"{name}.fmu"


def test_every_folder_of_released_fmus_is_known() -> None:
    assert {path.parent.name for path in (ROOT / "fmus").glob("*/*.fmu")} == set(RELEASED)


@pytest.mark.parametrize("name", RELEASED)
def test_check_finds_nothing_wrong_with_a_released_fmu(name: str) -> None:
    assert check_fmu(released(name)) == []


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", essential(RELEASED, "duffing", "slider_crank"))
def test_fmpy_validates_a_released_fmu_without_a_problem(
    name: str, fmi: int, tmp_path: Path
) -> None:
    assert validate_fmu(released(name)) == []
    path = tmp_path / f"{name}.fmu"
    assert invoke("export", released(name), "--fmi", fmi, "-o", path).exit_code == 0
    assert validate_fmu(path) == []
    assert check_fmu(path) == []


@pytest.mark.parametrize("name", RELEASED)
def test_released_fmu_was_made_from_its_recipe(name: str) -> None:
    """Words and pictures may be newer than the FMU: nothing is learnt or measured by them."""
    _, provenance = read_fmu(released(name))
    recipes = [
        recipe_of_provenance(provenance, name),
        load_recipe(ROOT / "training" / f"{name}.toml"),
    ]
    learnt, expected = (recipe.model_dump() for recipe in recipes)
    for table in (learnt, expected):
        del table["description"], table["system"]["picture"]
    assert learnt == expected


@pytest.mark.parametrize("name", essential(RELEASED, "duffing"))
def test_released_fmu_is_as_accurate_as_promised(name: str) -> None:
    figures = validate_fmu_file(
        released(name), released_case(released(name)), FEW, lambda stage: lambda *state: None
    ).figures()
    assert figures.outputs[0].relative_rmse < RELEASED[name]


@pytest.mark.parametrize("name", ["duffing", "slider_crank", "robot_6r"])
def test_error_bound_at_rest_is_no_larger_than_in_motion(name: str) -> None:
    """Though the inputs of the training hardly ever rest."""
    surrogate, provenance = read_fmu(released(name))
    recipe = recipe_of_provenance(provenance, name)
    stream = Stream(TEST, AT_REST, (1.0, 1.0), 20.0)
    system, in_motion, at_rest = case_of(recipe).system, [], []
    for index in range(5):
        moving = draw(recipe, system, stream, index).inputs
        resting = np.repeat(moving[-1:], round(20.0 / recipe.window.step), axis=0)
        bounds = surrogate.trust(np.concatenate([moving, resting])).bounds(0.95)
        in_motion.append(bounds[len(moving) // 2 : len(moving)])
        at_rest.append(bounds[-len(resting) // 2 :].max(axis=0))
    assert np.all(at_rest < np.quantile(np.concatenate(in_motion), 0.99, axis=0))


@pytest.mark.parametrize("name", RELEASED)
def test_model_card_shows_what_the_released_fmu_carries(name: str) -> None:
    _, provenance = read_fmu(released(name))
    measured = released_figures(provenance)
    assert measured is not None
    card = (ROOT / "fmus" / name / "README.md").read_text(encoding="utf-8")
    assert markdown(card_table(measured.rows)) in card


@pytest.mark.parametrize("name", RELEASED)
def test_readme_shows_the_error_that_the_released_fmu_carries(name: str) -> None:
    """Rows begin as ``python fmus/table.py`` prints them; the README adds what the FMU is."""
    expected = row_of(released(name))
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (line,) = [line for line in readme.splitlines() if line.startswith(f"| [`{name}`](fmus/")]
    cells = [cell.strip() for cell in line.split("|")[1:-1]]
    assert cells[0].startswith(f"{expected[0]}, ")
    assert cells[1:] == list(expected[1:])
