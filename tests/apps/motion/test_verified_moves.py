"""Moves are planned until a reference model confirms them; margins get a factor for such moves."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.motion import (
    Limits,
    MotionError,
    MoveProblem,
    MoveTask,
    coordinates_of,
    earliest,
    inputs_of,
    quietest,
    read_task,
)
from slide_fmu.apps.motion.calibration import least_moves, random_task, rank_of
from slide_fmu.apps.motion.costs import residual
from slide_fmu.apps.motion.margin import Margins, judge, margins_of, what_margins_are
from slide_fmu.apps.motion.recipe_table import check_table
from slide_fmu.apps.motion.solve import factor_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.recipe.recipe import RecipeError
from tests.acceptance.conftest import invoke
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
CRANK = ROOT / "fmus" / "slider_crank_payload" / "slider_crank_payload.fmu"
TURN = ROOT / "docs" / "tutorials" / "turned_payload.toml"
FREE = np.array([np.inf])


def crank_problem(tolerance: float = 5e-4) -> MoveProblem:
    """A crank turns; its slider is heavier than that of the surrogate, as the reference says."""
    released = slide.load(CRANK)
    real = released.at({"slider_mass": 1.2})
    limits = Limits(-FREE, FREE, np.array([8.0]), np.array([20.0]), FREE)
    ends = np.full(1, 0.5), np.full(1, 2.5)
    problem = MoveProblem(released.at({"slider_mass": 1.0}), *ends, limits, tolerance)

    def reference(inputs: FloatArray) -> FloatArray:
        outputs = real.predict_newest(inputs)
        return np.concatenate([outputs[:1], outputs])

    return replace(problem, reference=reference)


def true_residual(problem: MoveProblem, motion: FloatArray, end: int) -> float:
    """The largest distance from rest after a move, by the reference and a rest of its own."""
    before, after = np.tile(problem.start, (200, 1)), np.tile(problem.goal, (400, 1))
    angles = np.concatenate([before, motion[:end], after])
    assert problem.reference is not None
    inputs = inputs_of(coordinates_of(problem.surrogate.inputs), angles)
    outputs = problem.reference(inputs)[201:, 0]
    return float(np.abs(outputs[end:] - outputs[-1]).max())


def test_a_verified_move_is_within_the_tolerance_by_the_reference() -> None:
    problem = crank_problem()
    blind = earliest(replace(problem, reference=None)).move
    assert true_residual(problem, blind.motion, blind.end) > problem.tolerance
    found = earliest(problem)
    assert found.move.name == "optimised"
    assert found.rounds > 1
    assert true_residual(problem, found.move.motion, found.move.end) <= problem.tolerance
    np.testing.assert_allclose(found.move.margin, 0)


def test_a_quietest_move_is_planned_again_with_what_the_reference_says() -> None:
    problem = crank_problem()
    found = quietest(problem, 1.0)
    assert found.rounds > 0
    left = true_residual(problem, found.move.motion, found.move.end)
    assert left <= problem.tolerance
    reported = found.move.cost(residual, found.response, problem.tolerance)
    assert reported == pytest.approx(left, rel=0.05)


def test_a_tolerance_that_the_reference_confirms_for_no_move_is_refused_with_figures() -> None:
    problem = crank_problem(1e-8)
    for search in (earliest, lambda problem: quietest(problem, 0.8)):
        with refused(MotionError, "by the reference model, the best of", "within the tolerance"):
            search(problem)


@pytest.mark.extended
def test_margins_have_a_factor_of_the_task_or_of_the_recipe() -> None:
    task = read_task(TURN)
    assert isinstance(task, MoveTask)
    carried = {"recipe": "[apps.motion]\nmargin_factor = 3.0\n"}
    own = task.model_copy(update={"margin_factor": 2.0})
    found = [factor_of(one, at) for one, at in ((own, carried), (task, carried), (task, None))]
    assert found == [2.0, 3.0, 1.0]
    problem, times = replace(crank_problem(), reference=None), []
    for factor in (1.0, 4.0):
        margins = margins_of(*read_fmu(CRANK), factor)
        times.append(earliest(replace(problem, margins=margins)).move.end)
    assert times[1] > times[0]


def test_margin_without_bound_and_estimate_is_the_error_that_was_measured() -> None:
    released, provenance = read_fmu(CRANK)
    inputs = np.tile([1.0, 0.0], (300, 1))
    measured = dict(provenance or {})["measured"]
    below = measured["validation"]["in range"]["outputs"][0]["rmse"]
    margins = margins_of(released, provenance, 2.0)
    np.testing.assert_array_equal(judge(released, inputs[None], margins)[0].margins, 2 * 2 * below)
    assert "twice the RMS error that was measured" in what_margins_are(released, margins)
    assert margins_of(released, None) == Margins()
    assert what_margins_are(released, Margins()).startswith("nothing")
    robot = read_fmu(ROOT / "fmus" / "robot_6r" / "robot_6r.fmu")
    assert margins_of(*robot) == Margins()
    with refused(MotionError, "measured figures in the FMU", "make the FMU anew"):
        margins_of(released, {"measured": {"name": 3}})


@pytest.mark.parametrize("table", [{"margin_factor": 0}, {"margin_factor": "2"}, {"factor": 2.0}])
def test_tables_of_the_recipe_that_have_no_factor_are_refused(table: dict[str, object]) -> None:
    with refused(RecipeError, "[apps.motion]", "expected"):
        check_table(table)


def test_factor_is_the_conformal_quantile() -> None:
    """Of N moves it is the k-th smallest ratio, with k the next integer of 0.95 (N + 1)."""
    assert least_moves() == 19
    assert [rank_of(moves) for moves in (18, 19, 39, 40, 100)] == [19, 19, 38, 39, 96]


def test_random_tasks_are_in_the_ranges_and_turn_no_further_than_the_task() -> None:
    rng, task = np.random.default_rng(0), read_task(TURN)
    assert isinstance(task, MoveTask)
    coordinates = coordinates_of(slide.load(CRANK).inputs)
    drawn = [random_task(task, coordinates, rng) for _ in range(50)]
    turns = np.array([one.goal[0] - one.start[0] for one in drawn])
    assert np.abs(turns).max() <= 2.5
    assert turns.min() < 0 < turns.max()
    assert np.abs([one.start[0] for one in drawn]).max() <= math.pi
    assert {one.tolerance for one in drawn} == {task.tolerance}
    robot = coordinates_of(slide.load(ROOT / "fmus" / "robot_6r" / "robot_6r.fmu").inputs)
    reach = read_task(ROOT / "docs" / "tutorials" / "pick_and_place.toml")
    assert isinstance(reach, MoveTask)
    for _ in range(20):
        random_task(reach, robot, rng).points(robot)  # raises if one is out of range


def test_too_few_moves_for_a_factor_are_refused_with_the_least_number(tmp_path: Path) -> None:
    done = invoke("motion", CRANK, TURN, "--calibrate", "18")
    assert done.exit_code == 1
    assert "18 moves; expected at least 19" in " ".join(done.output.split())


@pytest.mark.extended
def test_calibration_prints_the_factor_and_where_to_write_it(tmp_path: Path) -> None:
    done = invoke("motion", CRANK, TURN, "--calibrate", "19", "--json", tmp_path / "a.json")
    assert done.exit_code == 0, done.output
    figures = json.loads((tmp_path / "a.json").read_text())
    assert figures["moves"] == 19
    assert f"margin_factor = {figures['margin_factor']:.1f}"[:-1] in done.output
    assert "[apps.motion]" in done.output


@pytest.mark.extended
def test_verified_moves_are_named_with_rounds_and_residual(tmp_path: Path) -> None:
    done = invoke("motion", CRANK, TURN, "--verify", "-o", tmp_path, "--json", tmp_path / "a.json")
    assert done.exit_code == 0, done.output
    figures = json.loads((tmp_path / "a.json").read_text())
    assert figures["rounds"] >= 1
    assert figures["reference"]["move"]["residual"] <= figures["task"]["tolerance"]
    assert figures["move"]["residual"] != figures["reference"]["move"]["residual"]
    assert "Verified in" in done.output
    assert "Verified in" in (tmp_path / "report.html").read_text()
