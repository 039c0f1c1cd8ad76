"""What is done with the system of a recipe tells its mistakes with the recipe's name."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.memory.modes import UnstableModeError
from slide_fmu.pipeline.case_checks import check_case, guarded_case, require_names_in_fmu
from slide_fmu.pipeline.run_folder import RunFolder
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.recipe import ParameterRecipe, RecipeError
from tests.acceptance.conftest import invoke
from tests.recipes import TINY, tiny_recipe, tiny_state_space_recipe
from tests.refusals import refused

FMUS = Path(__file__).parents[2] / "fmus"


def fail(case: Case, kind: type[ValueError]) -> None:
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
        guarded_case(case_of(recipe), fail, kind)


STARTS = {
    "missing file": ("nowhere.fmu", r"no file 'nowhere\.fmu' in .*; expected the path of one"),
    "no FMU": (__file__, "is a Python file by its name; expected an FMU"),
    "other step": (f"{FMUS}/duffing/duffing.fmu", r"has the step 0\.03; expected 0\.015625"),
    "other names": (f"{FMUS}/slider_crank/slider_crank.fmu", "has the .*; expected"),
}


@pytest.mark.parametrize("case", STARTS)
def test_fmu_that_no_training_can_begin_with_is_refused_before_data_are_made(case: str) -> None:
    start, message = STARTS[case]
    recipe = tiny_state_space_recipe(training={"start": start})
    with pytest.raises(RecipeError, match=rf"^recipe 'tiny': training\.start = .*{message}"):
        check_case(case_of(recipe))


def test_network_of_its_own_is_refused_where_a_training_begins_with_an_fmu() -> None:
    """The degree in which weights follow physical parameters is the recipe's, if it has some."""
    start, place = f"{FMUS}/duffing/duffing.fmu", "training.start = .* with the table network"
    tables = {"network": {"parameter_degree": 1}, "training": {"start": start}}
    with pytest.raises(RecipeError, match=rf"{place} = {{'parameter_degree': 1}}; expected none"):
        check_case(case_of(tiny_state_space_recipe(**tables)))
    mass = {"parameters": {"mass": {"range": [1.0, 2.0]}}}
    with refused(RecipeError, "expected 0.015625", "step 0.03"):
        check_case(case_of(tiny_state_space_recipe(**tables, **mass)))


def test_fmu_without_a_companion_is_refused_where_a_bound_goes_on_with_it() -> None:
    tables = {
        "training": {"start": f"{FMUS}/linear/linear.fmu"},
        "data": {"bound": 40, "calibration": 60, "duration": 4.0},
        "bound": {},
    }
    with refused(RecipeError, "has no error bound; expected one", "remove the table [bound]"):
        check_case(case_of(tiny_state_space_recipe(**tables)))


@pytest.mark.parametrize("subcommand", ["try", "run"])
def test_missing_start_of_a_training_is_told_before_any_trajectory_is_made(
    tmp_path: Path, subcommand: str
) -> None:
    recipe = tmp_path / "tiny.toml"
    tables = TINY[: TINY.index("[network]")] + '[training]\nstart = "nowhere.fmu"\n'
    recipe.write_text(tables, encoding="utf-8")
    result = invoke(subcommand, recipe, "--runs", tmp_path / "runs")
    assert result.exit_code == 1
    assert "training.start = 'nowhere.fmu': no file" in " ".join(result.output.split())
    assert not RunFolder(tmp_path / "runs" / "tiny").trajectories.exists()


@pytest.mark.parametrize("name", ["window_filled", "time", "initial_force", "force"])
def test_parameter_whose_name_the_fmu_needs_is_refused_before_any_data(name: str) -> None:
    parameters = {name: ParameterRecipe(range=(1.0, 2.0))}
    recipe = tiny_recipe().model_copy(update={"parameters": parameters})
    with pytest.raises(RecipeError, match=rf"parameter '{name}'.*rename the signal or"):
        require_names_in_fmu(recipe, case_of(tiny_recipe()).system)


def test_names_of_a_usual_recipe_are_free() -> None:
    recipe = tiny_recipe()
    require_names_in_fmu(recipe, case_of(recipe).system)
