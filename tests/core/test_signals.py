"""Signals and trajectories refuse what cannot be meant."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import (
    Signal,
    Trajectory,
    check_inputs,
    cosines_of,
    hold_of,
    on_circles,
)
from tests.refusals import refused


@pytest.mark.parametrize("name", ["", "two words", "tab\there", " "])
def test_signal_needs_a_name_without_white_space(name: str) -> None:
    with pytest.raises(ValueError, match="without white space") as caught:
        Signal(name, "N", 0.0, 1.0)
    assert repr(name) in str(caught.value)


@pytest.mark.parametrize(
    ("low", "high"), [(1.0, 1.0), (2.0, 1.0), (math.nan, 1.0), (0.0, math.inf), (-math.inf, 0.0)]
)
def test_signal_needs_a_finite_range(low: float, high: float) -> None:
    with refused(ValueError, "signal 'force': range [", "] N; expected two finite"):
        Signal("force", "N", low, high)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1e308), (-1e308, 1e308), (-1e301, 0.0)])
def test_signal_needs_a_range_whose_width_is_finite_too(low: float, high: float) -> None:
    with refused(ValueError, "range [", "expected ends between", "300 and 1e"):
        Signal("force", "N", low, high)


@pytest.mark.parametrize(
    ("low", "high", "start", "value"),
    [
        (-1.0, 2.0, None, 0.0),
        (1.0, 2.0, None, 1.0),
        (-3.0, -2.0, None, -2.0),
        (-1.0, 2.0, 2.0, 2.0),
        (1.0, 2.0, 1.5, 1.5),
    ],
)
def test_start_is_what_is_given_or_nearest_to_zero(
    low: float, high: float, start: float | None, value: float
) -> None:
    assert Signal("force", "N", low, high, start=start).start_value == value


@pytest.mark.parametrize("start", [-0.1, 1.1, math.nan, math.inf])
def test_start_lies_in_the_range(start: float) -> None:
    with pytest.raises(ValueError, match=rf"signal 'force': start {start}; expected a value"):
        Signal("force", "N", 0.0, 1.0, start=start)


def test_trajectory_has_one_output_more_than_inputs() -> None:
    trajectory = Trajectory(0.25, np.zeros((4, 2)), np.zeros((5, 1)))
    assert trajectory.time.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    for count in (4, 6):
        with pytest.raises(ValueError, match=f"4 inputs and {count} outputs"):
            Trajectory(0.25, np.zeros((4, 2)), np.zeros((count, 1)))


def test_trajectory_has_two_axes() -> None:
    with refused(ValueError, "inputs of shape (4,)"):
        Trajectory(0.25, np.zeros(4), np.zeros((5, 1)))
    with refused(ValueError, "outputs of shape (5,)"):
        Trajectory(0.25, np.zeros((4, 1)), np.zeros(5))


def test_signal_needs_a_known_hold_and_angle() -> None:
    with refused(ValueError, "expected one of", "hold 'ramp'", "order"):
        Signal("u", "N", 0.0, 1.0, hold="ramp")  # type: ignore[arg-type]
    with refused(ValueError, "expected one of", "angle 'tangent'", "'sine'"):
        Signal("u", "N", 0.0, 1.0, angle="tangent")  # type: ignore[arg-type]


COSINE = Signal("c", "1", -1.0, 1.0, angle="cosine", hold="first_order")
SINE = Signal("s", "1", -1.0, 1.0, angle="sine", hold="first_order")
OTHER = Signal("u", "N", -2.0, 3.0, hold="first_order")


def test_inputs_that_belong_together_are_accepted() -> None:
    for inputs in ((OTHER,), (COSINE, SINE), (OTHER, COSINE, SINE, COSINE, SINE, OTHER)):
        check_inputs(inputs)
        assert hold_of(inputs) == "first_order"
        assert [inputs[index] for index in cosines_of(inputs)] == [COSINE] * inputs.count(COSINE)


def test_cosines_and_sines_on_circles_keep_their_directions() -> None:
    wide = replace(COSINE, low=-2.0, high=2.0), replace(SINE, low=-2.0, high=2.0)
    rows = np.array([[0.7, 0.3, 0.4, -0.1, 0.0], [0.5, 0.0, -2.0, 0.0, 0.0]])
    found = on_circles((OTHER, COSINE, SINE, *wide), rows)
    assert found == pytest.approx(
        np.array([[0.7, 0.6, 0.8, -2.0, 0.0], [0.5, 0.0, -1.0, 2.0, 0.0]])
    )
    assert rows[0, 1] == 0.3


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ((COSINE,), "'c' is the cosine of an angle; expected its sine directly behind it"),
        ((SINE,), "'s' is the sine of an angle; expected its cosine directly before it"),
        ((SINE, COSINE), "'s' is the sine of an angle; expected its cosine directly before it"),
        ((COSINE, OTHER, SINE), "'c' is the cosine of an angle; expected its sine"),
        ((COSINE, COSINE, SINE), "'c' is the cosine of an angle; expected its sine"),
        ((COSINE, SINE, SINE), "'s' is the sine of an angle; expected its cosine"),
        ((COSINE, replace(SINE, high=2.0)), r"\(-1.0, 1.0\) and \(-1.0, 2.0\); expected the same"),
        ((replace(COSINE, low=0.0), replace(SINE, low=0.0)), "expected the same range about 0"),
        (
            (OTHER, Signal("v", "N", 0, 1)),
            "several holds, {'u': 'first_order', 'v': 'zero_order'}",
        ),
    ],
)
def test_inputs_that_do_not_belong_together_are_refused(
    inputs: tuple[Signal, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        check_inputs(inputs)
