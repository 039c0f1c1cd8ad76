"""The whole way of a state-space network with an error estimator, and with trajectories beyond.

The recipe is larger than the one that ``test_bounded_way`` takes the whole way in ``make test``,
and has no error bound.
"""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from slide_fmu.core.measures import percent
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.reading import load_recipe
from tests.acceptance.conftest import SMALL_STATE_SPACE, Finished, invoke
from tests.estimates import kept_estimates
from tests.trajectories import read_split

pytestmark = pytest.mark.extended

LEARNT = {"in range": 0.03, "beyond the range": 0.2}
"""Relative RMSE after some two seconds of training; without learning it would be 1."""

FMU_TOLERANCE = 2e-6
"""FMU against numpy, relative to the output's range: rounding of single precision."""


def test_state_space_run_learns_the_range_and_something_beyond(state_space: Finished) -> None:
    for name, bound in LEARNT.items():
        output = state_space.figures["validation"][name]["outputs"][0]
        assert output["relative_rmse"] < bound, name
    recipe = load_recipe(state_space.recipe)
    split = read_split(recipe, state_space.fmu.parent / "trajectories", "beyond")
    assert len(split.inputs) == 6
    assert np.max(np.abs(split.inputs)) > 1000  # the end of the range, N


def test_finished_fmu_carries_the_state_space_network(state_space: Finished) -> None:
    surrogate, provenance = read_fmu(state_space.fmu)
    assert isinstance(surrogate.network, StateSpace)
    cell = surrogate.network.cell
    # the search chose the states, from two for the one mode in the band; two more serve the units
    orders = [tried["order"] for tried in state_space.figures["sizes_tried"]]
    assert orders[0] == 2
    assert len(cell.a) - 2 in orders
    assert len(cell.w) == 8
    assert state_space.figures["parameters"] == surrogate.network.count_parameters()
    assert provenance is not None
    assert provenance["recipe"] == SMALL_STATE_SPACE
    assert provenance["measured"] == state_space.released


def test_finished_state_space_fmu_run_by_fmpy_gives_what_numpy_gives(
    state_space: Finished,
) -> None:
    surrogate, _ = read_fmu(state_space.fmu)
    inputs = np.random.default_rng(3).uniform(-1000, 1000, (300, 1))
    with unpacked(state_space.fmu) as fmu:
        run = run_fmu(fmu, {"force": inputs[:, 0]}, ["position", "position_error_estimate"])
    signal = surrogate.outputs[0]
    allowed = FMU_TOLERANCE * (signal.high - signal.low)
    assert np.max(np.abs(run.values[1:, :1] - surrogate.predict_newest(inputs))) < allowed
    np.testing.assert_allclose(run.values[1:, 1:], surrogate.estimate_error(inputs), rtol=1e-4)


def test_report_shows_the_fading_memory(state_space: Finished) -> None:
    tests = state_space.figures["stability"]
    assert [test["amplitude"] for test in tests] == [1.0, 2.0, 4.0, 10.0]
    assert all(test["passed"] for test in tests)
    folder = state_space.fmu.parent
    page = (folder / "report.html").read_text(encoding="utf-8")
    heading = "<h2>Fading memory and boundedness</h2>"
    (section,) = re.findall(rf"{heading}(.*?)</section>", page, re.DOTALL)
    assert section.count("passed") == len(tests)
    assert section.count("data-chart=") == len(tests)
    assert percent(tests[0]["median_difference"]) in section
    surrogate, _ = read_fmu(state_space.fmu)
    assert isinstance(surrogate.network, StateSpace)
    assert f"{len(surrogate.network.cell.a)} states and 8 hidden units" in page
    assert not (folder / "stability.html").exists()  # the charts of a failure


def test_check_of_a_finished_state_space_fmu_finds_nothing(state_space: Finished) -> None:
    result = invoke("check", state_space.fmu, "--json", "-")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["problems"] == []


def test_validate_measures_again_what_the_state_space_report_says(state_space: Finished) -> None:
    reported = state_space.figures["validation"]["in range"]
    call = ("--trajectories", reported["trajectories"], "--seed", reported["seed"], "--json", "-")
    result = invoke("validate", state_space.fmu, *call)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["outputs"] == reported["outputs"]


def test_finished_state_space_run_is_not_done_again(state_space: Finished) -> None:
    with kept_estimates():
        result = invoke("train", state_space.recipe, "--runs", state_space.runs, "--json", "-")
    assert result.exit_code == 0, result.output
    surrogate = state_space.runs / state_space.name / "surrogate.slide"
    assert surrogate.read_bytes() == read_fmu(state_space.fmu)[0].to_bytes()
