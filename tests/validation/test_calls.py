"""Rows of an FMU and a reference that are made by hand, so that every figure is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.fmu.description.variables import HELD
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.validation import calls
from slide_fmu.validation.calls import (
    CallAnswers,
    ErrorLevels,
    InputsLabel,
    MeasuredMotion,
    answers,
    row_of,
)
from slide_fmu.validation.input_courses import Lines, Stairs
from slide_fmu.validation.row import HARMFUL, Call, Row
from tests.python_fmus import write_python_fmu
from tests.refusals import refused

STEP = 0.1
SLAVE = Path(__file__).parents[1] / "own_models" / "knowing_slave.py"
INPUT, OUTPUT = Signal("u", "N", -9, 9, hold="first_order"), Signal("y", "m", -9, 9)
LEVELS = ErrorLevels(np.zeros(1), usual=np.array([0.05]))


@pytest.fixture(scope="module")
def knowing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[UnpackedFmu]:
    path = write_python_fmu("Knowing", SLAVE, tmp_path_factory.mktemp("fmu") / "Knowing.fmu")
    with unpacked(path) as files:
        yield files


def ramp(count: int, slope: float) -> MeasuredMotion:
    """An input that rises, and a reference that equals it at any time."""
    rows = slope * STEP * np.arange(1.0, count + 1)[:, None]
    course = Lines(STEP, np.concatenate([[[0.0]], rows[:-1]]))
    truth = course(STEP * np.arange(count + 1.0))
    return MeasuredMotion(course, truth, STEP, 0.0)


def row(fmu: UnpackedFmu, motion: MeasuredMotion, call: Call, step: float) -> Row:
    found = row_of(
        [answers(fmu, [INPUT], [OUTPUT], motion, call, step)],
        [OUTPUT],
        InputsLabel("in range", "ramp"),
        call,
        (step, STEP),
        LEVELS,
    )
    assert found is not None
    return found


def test_the_plain_call_is_late_by_a_step_and_known_inputs_are_not(knowing: UnpackedFmu) -> None:
    motion = ramp(40, 1.0)
    late, known = (row(knowing, motion, call, STEP) for call in ("plain", "known"))
    assert late.outputs[0].largest_error == pytest.approx(0.1)
    assert known.outputs[0].largest_error == pytest.approx(0.0, abs=1e-12)
    assert late.steps == known.steps == 1.0


@pytest.mark.parametrize("parts", [0.5, 2.0, 4.0, 5.0])
def test_a_shorter_step_is_late_by_less_and_is_compared_at_the_samples(
    knowing: UnpackedFmu, parts: float
) -> None:
    """The importer sends what the reference saw between its samples."""
    found = row(knowing, ramp(40, 1.0), "plain", STEP / parts)
    assert found.outputs[0].largest_error == pytest.approx(0.1 / parts)
    assert found.samples == (20 if parts < 1 else 40)
    assert found.step_s == pytest.approx(STEP / parts)


def test_a_step_that_no_sample_follows_has_few_points(knowing: UnpackedFmu) -> None:
    """Points at 0.07 s meet samples at 0.1 s every 0.7 s."""
    assert row(knowing, ramp(40, 1.0), "plain", 0.07).samples == 5


def test_shares_count_from_where_the_bound_is_filled(knowing: UnpackedFmu) -> None:
    found = row(knowing, ramp(40, 0.9), "plain", STEP)
    assert (found.samples, found.counted) == (40, 31)
    assert (found.covered, found.trusted) == (1.0, 1.0)
    assert found.width == pytest.approx(2.0)


def test_a_bound_that_is_never_filled_has_no_shares(knowing: UnpackedFmu) -> None:
    found = row(knowing, ramp(40, 1.0), "plain", STEP / 4)
    assert (found.samples, found.counted) == (40, 0)
    shares = (found.covered, found.width, found.trusted, found.harmful, found.silent)
    assert shares == (None,) * 5
    assert found.valid is None
    assert found.error > 0


@pytest.mark.parametrize("slope", [4.0, -4.0])
def test_harm_is_silent_where_it_is_trusted_and_above_the_bound(
    knowing: UnpackedFmu, slope: float
) -> None:
    """An error of 0.4 is eight times usual and four times the bound; below 0 it is not trusted."""
    found = row(knowing, ramp(20, slope), "plain", STEP)
    assert (found.harmful, found.covered) == (1.0, 0.0)
    assert (found.silent, found.trusted) == ((1.0, 1.0) if slope > 0 else (0.0, 0.0))
    assert found.honest is (slope < 0)
    assert found.over_bound == (pytest.approx(4.0) if slope > 0 else None)


def made(error: FloatArray, trusted: list[bool]) -> CallAnswers:
    count = len(error)
    bounds = np.full(error.shape, 0.2)
    truth = np.tile([[1.0], [-1.0]], (count // 2, error.shape[1]))
    return CallAnswers(truth + error, truth, bounds, np.array(trusted), np.full(count, True))


def test_an_error_is_silent_only_if_the_same_output_is_harmful_and_above_its_bound() -> None:
    """The first output is above its bound but usual, the second harmful but covered."""
    levels = ErrorLevels(np.zeros(2), np.array([1.0, 0.01]))
    error = np.array([[0.5, 0.1], [0.5, 0.3]])
    found = row_of(
        [made(error, [True, True])], [OUTPUT, OUTPUT], InputsLabel("", ""), "plain", (1, 1), levels
    )
    assert found is not None
    assert (found.harmful, found.silent) == (1.0, 0.5)
    assert [output.covered for output in found.outputs] == [0.0, 0.5]
    assert (found.covered, found.error) == (0.0, pytest.approx(0.5))


def test_without_a_usual_level_nothing_is_harmful() -> None:
    found = row_of(
        [made(np.full((2, 1), 9.0), [True, True])],
        [OUTPUT],
        InputsLabel("", ""),
        "plain",
        (1, 1),
        ErrorLevels(np.zeros(1)),
    )
    assert found is not None
    assert (found.harmful, found.silent, found.width, found.valid) == (None,) * 4
    assert found.covered == 0.0


def test_stairs_hold_over_their_step_at_any_time() -> None:
    course = Stairs(0.03, np.array([[1.0], [2.0], [3.0]]))
    times = 0.0075 * np.arange(12.0)
    assert course(times)[:, 0].tolist() == [1.0] * 4 + [2.0] * 4 + [3.0] * 4


def test_angles_turn_evenly_and_planned_motions_bend_between_samples() -> None:
    turn = 0.2 * np.arange(1.0, 40.0)
    rows = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    at = 0.05 + 0.1 * np.arange(1.0, 38.0)
    even = Lines(0.1, rows, (0,))(at)
    assert np.allclose(np.arctan2(even[:, 1], even[:, 0]) % (2 * np.pi), 2 * at % (2 * np.pi))
    bent = np.sin(0.3 * np.arange(1.0, 40.0))[:, None]
    exact = np.sin(3 * at)
    errors = [np.abs(Lines(0.1, bent, (), c)(at)[5:-5, 0] - exact[5:-5]).max() for c in (0, 1)]
    assert errors[1] < 0.1 * errors[0]


TWO = [OUTPUT, Signal("z", "m", -9, 9)]
USUAL = np.array([0.5, 2.0])


def judged(
    error: list[list[float]],
    bounds: list[list[float]] | None = None,
    trusted: list[bool] | None = None,
    filled: list[bool] | None = None,
    size: float = 1.0,
) -> Row:
    """The row of two outputs whose usual errors are 0.5 and 2, and whose sizes are equal."""
    errors = np.array(error)
    count = len(errors)
    given = CallAnswers(
        errors,
        np.zeros_like(errors),
        None if bounds is None else np.array(bounds),
        None if trusted is None else np.array(trusted),
        np.full(count, True) if filled is None else np.array(filled),
    )
    levels = ErrorLevels(np.zeros(2), USUAL, np.full(2, size))
    found = row_of([given], TWO, InputsLabel("", ""), "plain", (0.1, 0.4), levels)
    assert found is not None
    return found


def test_errors_are_harmful_strictly_above_three_times_what_is_usual() -> None:
    """In any output; the second row has exactly three times the usual error in both."""
    assert HARMFUL == 3.0
    assert judged([[0.0, 0.0], [1.5, 6.0]]).harmful == 0.0
    assert judged([[1.51, 0.0], [0.0, -6.1], [1.5, 6.0], [1.4, 1.4]]).harmful == 0.5


def test_harm_is_silent_strictly_above_the_bound() -> None:
    bounds = [[1.6, 7.0]] * 4
    error = [[1.6, 7.0], [1.7, 0.0], [0.0, 7.5], [1.7, 7.5]]
    found = judged(error, bounds, [True, True, True, False])
    assert (found.harmful, found.silent, found.trusted) == (1.0, 0.5, 0.75)
    at_the_level = judged([[1.5, 0.0]], [[0.1, 0.1]], [True])
    assert (at_the_level.harmful, at_the_level.silent) == (0.0, 0.0)


def test_bound_covers_an_error_that_equals_it_and_each_output_has_its_own_share() -> None:
    found = judged([[1.0, 1.0], [-1.0, 3.0], [2.0, 0.5]], [[1.0, 1.0]] * 3, [True, True, True])
    assert [one.covered for one in found.outputs] == pytest.approx([2 / 3, 2 / 3])
    assert judged([[1.0, -1.0]], [[1.0, 1.0]], [True]).covered == 1.0


def test_width_is_the_mean_bound_of_each_output_over_its_usual_error() -> None:
    found = judged([[0.0, 0.0]] * 3, [[0.5, 1.0], [1.0, 2.0], [3.0, 9.0]], [True] * 3)
    assert [one.width for one in found.outputs] == pytest.approx([1.5 / 0.5, 4.0 / 2.0])


def test_width_is_finite_where_errors_are_usually_zero() -> None:
    given = [made(np.zeros((2, 1)), [True, True])]
    levels = ErrorLevels(np.zeros(1), np.zeros(1))
    found = row_of(given, [OUTPUT], InputsLabel("", ""), "plain", (1.0, 1.0), levels)
    assert found is not None
    assert found.width is not None
    assert np.isfinite(found.width)


def test_largest_error_over_its_bound_is_that_where_the_fmu_is_trusted() -> None:
    error, bounds = [[0.4, 1.0], [0.1, -6.0], [9.0, 9.0]], [[0.1, 1.0], [1.0, 4.0], [1.0, 1.0]]
    assert judged(error, bounds, [True, True, False]).over_bound == pytest.approx(4.0)
    assert judged(error, bounds, [False, True, False]).over_bound == pytest.approx(1.5)
    assert judged(error, bounds, [False] * 3).over_bound is None
    assert judged(error, bounds).over_bound is None


def test_errors_count_from_the_first_sample_and_shares_where_the_bound_is_filled() -> None:
    """Without a bound, all samples count."""
    error, bounds = [[3.0, -4.0], [9.0, 0.0], [0.0, 0.0]], [[1.0, 1.0]] * 3
    filled = [False, True, True]
    found = judged(error, bounds, [True, False, True], filled, size=10.0)
    assert (found.trajectories, found.samples, found.counted) == (1, 3, 2)
    assert (found.step_s, found.steps) == (0.1, pytest.approx(4.0))
    assert [one.largest_error for one in found.outputs] == [9.0, 4.0]
    assert [one.rmse for one in found.outputs] == pytest.approx([np.sqrt(30), np.sqrt(16 / 3)])
    assert found.error == pytest.approx(np.sqrt(30) / 10.0)
    assert (found.harmful, found.trusted, found.covered) == (0.5, 0.5, 0.5)
    without = judged(error, filled=filled)
    assert (without.counted, without.harmful) == (3, pytest.approx(2 / 3))
    assert (without.covered, without.width, without.trusted, without.silent) == (None,) * 4


def test_motions_count_together_and_a_bound_only_if_all_of_them_have_it() -> None:
    one, other = made(np.full((2, 1), 0.1), [True, True]), made(np.full((4, 1), 0.4), [False] * 4)
    terms = [OUTPUT], InputsLabel("", ""), "plain", (1.0, 1.0), ErrorLevels(np.zeros(1))
    both = row_of([one, other], *terms)
    assert both is not None
    assert (both.trajectories, both.samples) == (2, 6)
    assert (both.covered, both.trusted) == pytest.approx((1 / 3, 1 / 3))
    assert both.error == pytest.approx(np.sqrt((2 * 0.1**2 + 4 * 0.4**2) / 6))
    unbounded = row_of([one, replace(other, bounds=None, trusted=None)], *terms)
    assert unbounded is not None
    assert (unbounded.covered, unbounded.trusted, unbounded.counted) == (None, None, 6)
    assert row_of([made(np.zeros((0, 1)), [])], *terms) is None


def constant(samples: int, first: float = 0.0, grid: float = STEP) -> MeasuredMotion:
    course = Stairs(grid, np.zeros((samples, 1)))
    return MeasuredMotion(course, np.zeros((samples + 1, 1)), grid, first)


def test_points_count_from_the_first_time_on_but_for_rounding() -> None:
    """In floats 3 * 0.1 is more than 0.3."""
    numbers, places = constant(10, first=3 * 0.1).points(0.3)
    assert (numbers.tolist(), places.tolist()) == ([1, 2, 3], [3, 6, 9])
    assert constant(10, first=0.31).points(0.3)[0].tolist() == [2, 3]
    assert constant(10, first=0.5).points(STEP)[1].tolist() == [5, 6, 7, 8, 9, 10]


@pytest.mark.parametrize(("off", "count"), [(0.0, 3), (1e-8, 3), (1e-4, 0)])
def test_points_count_where_their_time_is_a_sample_s_but_for_rounding(
    off: float, count: int
) -> None:
    assert len(constant(12).points(4 * STEP * (1 - off))[0]) == count


def test_rounding_of_a_long_step_does_not_make_a_sample_of_any_time() -> None:
    """What is the same is relative to the longer of communication step and grid."""
    assert len(constant(10, grid=1.0).points(0.5 + 1e-9)[0]) == 10
    assert len(constant(10, grid=1.0).points(0.5 + 1e-5)[0]) == 0
    fine = constant(4000, grid=1e-3)
    assert len(fine.points(1.0 + 2e-7)[0]) == 4  # at most 8e-4 of the grid, 8e-7 of a step
    assert len(fine.points(1.0 + 1e-5)[0]) == 0


def test_steps_of_a_motion_are_those_that_end_within_it_but_for_rounding() -> None:
    assert [constant(10).count(step) for step in (0.1, 0.1 / 3, 0.3, 1.0, 1.1)] == [
        10, 30, 3, 1, 0,
    ]  # fmt: skip
    assert constant(3).count(0.1) == 3  # 3 * 0.1 / 0.1 may be less than 3 in floats


def test_motion_of_a_single_step_is_measured_and_a_shorter_one_is_refused(
    knowing: UnpackedFmu,
) -> None:
    terms = knowing, [INPUT], [OUTPUT]
    assert len(answers(*terms, constant(10), "plain", 1.0).outputs) == 1
    with refused(ValueError, "communication step of 1.1 s", "of 1 s"):
        answers(*terms, constant(10), "plain", 1.1)


@pytest.mark.parametrize(
    ("course", "call", "step", "told"),
    [
        (Stairs(STEP, np.ones((4, 1))), "plain", STEP, True),
        (Stairs(STEP, np.ones((4, 1))), "plain", STEP * (1 + 1e-9), True),
        (Stairs(STEP * (1 + 1e-9), np.ones((4, 1))), "plain", STEP, True),
        (Stairs(STEP, np.ones((4, 1))), "plain", STEP * (1 + 4e-6), False),
        (Stairs(STEP, np.ones((4, 1))), "plain", STEP / 4, False),
        (Stairs(2 * STEP, np.ones((4, 1))), "plain", STEP, False),
        (Lines(STEP, np.ones((4, 1))), "plain", STEP, False),
        (Lines(STEP, np.ones((4, 1))), "known", STEP, True),
        (Stairs(STEP, np.ones((4, 1))), "known", STEP / 4, True),
    ],
)
def test_fmu_is_told_that_inputs_are_held_where_it_cannot_see_it(
    course: Lines | Stairs,
    call: Call,
    step: float,
    told: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Values at its own step may be stairs or samples of a smooth signal."""
    seen: dict[str, float] = {}

    def run(*given: Any) -> None:
        *_, parameters, at, timed = given
        assert (at, timed) == (step, False)
        seen.update(parameters)

    monkeypatch.setattr(calls, "run_fmu", run)
    fmu: Any = SimpleNamespace(references={HELD: 1}, step=STEP)
    calls.run_in_call(fmu, [INPUT], course, [], (call, step, 3), {"mass": 2.0})
    assert seen == {"mass": 2.0, **({HELD: 1.0} if told else {})}
