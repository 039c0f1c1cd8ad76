"""Inputs between the samples of a draw, as an importer with a shorter step sets them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.data.draws import Draw
from slide_fmu.validation.input_courses import Lines, Stairs, course_of

STEP = 0.25
ROWS = np.array([[1.0], [3.0], [2.0]])
DRAWN = Draw(kind=0, factor=1.0, initial=None, inputs=ROWS, burn_in=0)
MOVING = (Signal("u", "N", -9, 9, hold="first_order"),)
HELD = (Signal("u", "N", -9, 9, hold="zero_order"),)


def at(course: Lines | Stairs, *times: float) -> list[float]:
    values: list[float] = course(np.array(times))[:, 0].tolist()
    return values


def course(signals: tuple[Signal, ...], drawn: Draw = DRAWN, planned: bool = False) -> FloatArray:
    """The inputs at every eighth of a step, as far as the samples reach."""
    return course_of(drawn, signals, STEP, planned)(STEP / 8 * np.arange(25.0))[:, 0]


def test_stairs_keep_the_first_value_before_and_the_last_after_their_samples() -> None:
    stairs = Stairs(STEP, ROWS)
    assert at(stairs, -1.0, 0.0, 0.75 * STEP, STEP, 2 * STEP, 9.0) == [1, 1, 1, 3, 2, 2]


@pytest.mark.parametrize("off", [-1e-8, 1e-8])
def test_time_of_a_sample_is_that_sample_but_for_rounding(off: float) -> None:
    """A step of 0.1 s, say, added ten times is not 1 s in floats."""
    times = STEP * (np.array([1.0, 2.0]) + off)
    assert at(Stairs(STEP, ROWS), *times) == [3, 2]
    assert at(Lines(STEP, ROWS), *times) == [1, 3]
    apart = STEP * (np.array([1.0, 2.0]) - 1e-3)
    assert at(Stairs(STEP, ROWS), *apart) == [1, 3]
    assert at(Lines(STEP, ROWS), *apart)[1] == pytest.approx(3 - 2e-3)


def test_lines_reach_each_value_by_the_end_of_its_step_and_rest_before_the_first() -> None:
    lines = Lines(STEP, ROWS)
    assert at(lines, 0.0, 0.5 * STEP, STEP, 1.5 * STEP, 2 * STEP, 3 * STEP) == [1, 1, 1, 2, 3, 2]


def test_held_inputs_of_a_draw_are_stairs_and_moving_ones_lines() -> None:
    eighths = np.arange(25) // 8
    np.testing.assert_array_equal(course(HELD), ROWS[np.minimum(eighths, 2), 0])
    nodes = STEP * np.arange(4.0)
    straight = np.interp(STEP / 8 * np.arange(25.0), nodes, [1.0, 1.0, 3.0, 2.0])
    np.testing.assert_allclose(course(MOVING), straight)


def test_planned_motions_alone_go_along_curves() -> None:
    smooth = replace(DRAWN, inputs=np.sin(0.3 * np.arange(1.0, 40.0))[:, None])
    times = STEP * (0.5 + np.arange(6.0, 30.0))
    exact = np.sin(0.3 * times / STEP)
    errors = [
        np.abs(course_of(smooth, MOVING, STEP, planned)(times)[:, 0] - exact).max()
        for planned in (False, True)
    ]
    assert errors[0] == pytest.approx(1 - np.cos(0.15), rel=0.01)
    assert errors[1] < 0.1 * errors[0]


def test_angles_of_a_draw_turn_evenly() -> None:
    """A straight line from cosine to cosine would cut the corner."""
    angles = np.array([1.0, 2.0, 3.0])
    turned = replace(DRAWN, inputs=np.stack([np.cos(angles), np.sin(angles)], axis=1))
    signals = (
        Signal("x", "1", -1, 1, hold="first_order", angle="cosine"),
        Signal("z", "1", -1, 1, hold="first_order", angle="sine"),
    )
    found = course_of(turned, signals, STEP, False)(STEP * np.array([1.5, 2.5]))
    np.testing.assert_allclose(found, [[np.cos(a), np.sin(a)] for a in (1.5, 2.5)])


def test_inputs_that_jump_within_a_step_do_so_when_the_reference_saw_it() -> None:
    """At 3/4 of the second step and at the end of the third; the first goes straight."""
    jumps = np.array([[np.nan], [0.75], [1.0]])
    drawn = replace(DRAWN, inputs=np.array([[1.0], [3.0], [2.0]]), jumps=jumps)
    found = course(MOVING, drawn)
    assert found[:9].tolist() == [1.0] * 9  # before the first sample inputs are constant
    assert found[9:].tolist() == [1.0] * 5 + [3.0] * 10 + [2.0]


def test_input_goes_straight_where_another_jumps() -> None:
    rows = np.array([[0.0, 0.0], [4.0, 8.0]])
    jumps = np.array([[np.nan, np.nan], [np.nan, 0.5]])
    found = course_of(replace(DRAWN, inputs=rows, jumps=jumps), MOVING * 2, STEP, False)
    times = STEP * np.array([-1.0, 0.5, 1.25, 1.5, 2.0, 3.0])
    assert found(times).tolist() == [[0, 0], [0, 0], [1, 0], [2, 8], [4, 8], [4, 8]]


def test_inputs_that_bend_between_samples_are_those_of_their_parts() -> None:
    """Four parts a step: every sample is the last of its parts."""
    between = np.array([2.0, 4.0, 0.0, 1.0, 5.0, 5.0, 6.0, 3.0, 3.0, 0.0, 1.0, 2.0])
    drawn = replace(DRAWN, between=between[:, None])
    np.testing.assert_allclose(course(MOVING, drawn)[2::2], between)
    np.testing.assert_allclose(course(MOVING, drawn)[8::8], ROWS[:, 0])
