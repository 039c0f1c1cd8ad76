"""Rows of an FMU and a reference that are made by hand, so that every figure is known."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.validation.calls import (
    CallAnswers,
    ErrorLevels,
    InputsLabel,
    MeasuredMotion,
    answers,
    row_of,
)
from slide_fmu.validation.input_courses import Lines, Stairs
from slide_fmu.validation.row import Call, Row
from tests.python_fmus import write_python_fmu

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
