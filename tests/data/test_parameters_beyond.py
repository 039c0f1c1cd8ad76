"""Values beyond the range of a parameter are asked for, and a model may fail on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.parameters import RANGE_SLACK
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import BEYOND_ATTEMPTS, split_stream
from slide_fmu.data.failures import is_beyond, kept_failures, remark_on_beyond
from slide_fmu.data.generation import generate
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.pipeline.job import open_job
from slide_fmu.propose.trial import open_trial, try_recipe
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import LoadError, SimulationError
from tests.progress import no_stages, silent

LAG = """
inputs = {"u": {"unit": "1", "range": [-1, 1]}}
outputs = {"y": {"unit": "1", "range": [-2, 2]}}
start = [0.0]
parameters = {"gain": 1.0}
def f(x, u, p):
    if not 0.0 <= p.gain <= %g:
        raise ValueError(f"no such gain, {p.gain:g}")
    return [(0.1 + p.gain) * u[0] - 4.0 * x[0]]
def g(x, u, p):
    return x
"""
TRAIN = 14


def lag(folder: Path, limit: float = 2.0, table: str = "", train: int = TRAIN) -> Path:
    """A recipe of a model that can be made up to a gain; its range is [0, 2]."""
    (folder / "lag.py").write_text(LAG % limit, encoding="utf-8")
    path = folder / "lag.toml"
    path.write_text(
        f"""
name = "lag"
description = "a lag with a gain"
[system]
kind = "function"
model = '{folder / "lag.py"}'
[parameters.gain]
range = [0.0, 2.0]
{table}
[window]
step = 0.1
n_in = 48
n_out = 16
[data]
duration = 6.0
burn_in = 1.0
train = {train}
validation = 2
[network]
order = 1
""",
        encoding="utf-8",
    )
    return path


def gains(recipe: Recipe, path: Path, split: str = "train") -> FloatArray:
    values = Trajectories.of(case_of(recipe), path).read(split).parameters
    assert values is not None
    return values[:, 0]


def parsed(path: Path) -> Recipe:
    return parse_recipe(path.read_text(encoding="utf-8"), path)


@pytest.mark.extended
def test_model_that_ends_at_its_range_is_never_made_beyond_it(tmp_path: Path) -> None:
    recipe, folder = parsed(lag(tmp_path)), tmp_path / "run" / "trajectories"
    assert generate(case_of(recipe), folder, None, silent) == TRAIN + 2
    assert kept_failures(case_of(recipe), folder) == []
    assert 1.8 < gains(recipe, folder).max() <= 2.0


@pytest.mark.extended
def test_model_that_fails_beyond_the_range_gets_values_within_and_a_remark(tmp_path: Path) -> None:
    recipe, folder = parsed(lag(tmp_path, table="beyond = 0.2")), tmp_path / "run" / "trajectories"
    asked = [
        drawn_parameters(recipe, split_stream(recipe, "train", index), index)["gain"]
        for index in range(TRAIN)
    ]
    lost = {index for index, value in enumerate(asked) if value > 2.0}
    assert lost
    assert generate(case_of(recipe), folder, None, silent) == TRAIN + 2
    failures, made = kept_failures(case_of(recipe), folder), gains(recipe, folder)
    assert {failure.index for failure in failures} == lost
    assert len(failures) == BEYOND_ATTEMPTS * len(lost)
    assert all(is_beyond(recipe, failure.name) for failure in failures)
    assert all(f"(with gain = {asked[one.index]:g})" in one.error for one in failures)
    assert all((made[index] == asked[index]) == (index not in lost) for index in range(TRAIN))
    assert made.max() <= 2.0
    remark = remark_on_beyond(case_of(recipe), folder)
    assert remark is not None
    assert remark.startswith(f"{len(lost)} trajectories with values beyond the ranges of the par")
    assert "parameters.gain.beyond asks for" in remark
    assert "no such gain" in remark


@pytest.mark.extended
def test_data_beyond_the_range_are_made_where_the_model_allows(tmp_path: Path) -> None:
    recipe = parsed(lag(tmp_path, 3.0, "beyond = 0.2"))
    generate(case_of(recipe), tmp_path / "run" / "trajectories", None, silent)
    assert gains(recipe, tmp_path / "run" / "trajectories").max() > 2.0
    assert gains(recipe, tmp_path / "run" / "trajectories", "validation").max() <= 2.0
    assert remark_on_beyond(case_of(recipe), tmp_path / "run" / "trajectories") is None


def test_model_that_fails_within_the_range_ends_the_run_with_the_value(tmp_path: Path) -> None:
    path = lag(tmp_path)
    model = tmp_path / "lag.py"  # which can be made at both ends of the range
    text = model.read_text(encoding="utf-8").replace("if not 0", "if 1.0 < p.gain < 1.9 or not 0")
    model.write_text(text, encoding="utf-8")
    recipe = parsed(path)
    expected = r"may fail \(data.most_failures.*no such gain.*\(with gain = 1\.\d+\).*parameters.N"
    with pytest.raises(SimulationError, match=expected):
        generate(case_of(recipe), tmp_path / "run" / "trajectories", None, silent)
    failures = kept_failures(case_of(recipe), tmp_path / "run" / "trajectories")
    assert not any(is_beyond(recipe, one.name) for one in failures)


@pytest.mark.extended
@pytest.mark.parametrize("table", ["", "beyond = 0.2"])
def test_trial_names_the_end_of_the_range_at_which_no_model_can_be_made(
    table: str, tmp_path: Path
) -> None:
    path = lag(tmp_path, 1.5, table)
    expected = r"with gain = 2, at the ends of the ranges.*no such gain.*narrow parameters.gain.ra"
    with pytest.raises(LoadError, match=expected):
        try_recipe(open_trial(path, tmp_path / "runs", silent), silent)


@pytest.mark.extended
@pytest.mark.parametrize(("limit", "beyond"), [(2.0, 0.2), (2.3, 0.1), (2.0, 0.0)])
def test_trial_remarks_where_the_model_fails_as_far_as_data_go(
    limit: float, beyond: float, tmp_path: Path
) -> None:
    path = lag(tmp_path, limit, f"beyond = {beyond}")
    trial = try_recipe(open_trial(path, tmp_path / "runs", silent), silent)
    told = [remark for remark in trial.remarks if "parameters.gain.beyond" in remark]
    fails = 2.0 * (1 + beyond) > limit
    assert len(told) == fails
    assert all("at 1 of 2 ends" in one and "(with gain = 2.4)" in one for one in told)


def test_values_of_the_released_recipe_go_beyond_the_range(tmp_path: Path) -> None:
    """The released slider-crank with an open payload was learnt from these."""
    job = open_job(Path("training/slider_crank_payload.toml"), tmp_path, no_stages)
    assert {name: table.beyond for name, table in job.recipe.parameters.items()} == {
        "slider_mass": 0.05
    }
    stream = split_stream(job.recipe, "train", 0)
    masses = [drawn_parameters(job.recipe, stream, index)["slider_mass"] for index in range(96)]
    np.testing.assert_allclose([min(masses), max(masses)], [0.45, 1.55], atol=0.02)
    assert min(masses) < 0.5 - RANGE_SLACK
    assert max(masses) > 1.5 + RANGE_SLACK
