"""Axes keep their limits, move in the least time, stop and turn back, and rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation import axis_moves
from tests.excitation.drawn import HIGH, JOINTS, LOW, kind_of, motion
from tests.refusals import refused

LIMITS: dict[str, Any] = {"speed": [1.4, 1.3, 2.1, 4.0], "acceleration": [5.7, 5.2, 8.5, 16.0]}
ANGLE = (
    Signal("x", "1", -1.0, 1.0, angle="cosine"),
    Signal("y", "1", -1.0, 1.0, angle="sine"),
)
STEP = 0.001
FINE = STEP * np.arange(100_001)


def rates(positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    speed = np.diff(positions, axis=0) / STEP
    return speed, np.diff(speed, axis=0) / STEP


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_limits_hold_and_are_reached(factor: float) -> None:
    positions = motion(kind_of("axis_moves", **LIMITS), JOINTS, 3, factor, FINE)
    speed, acceleration = (np.abs(values).max(axis=0) for values in rates(positions))
    assert np.all((positions >= LOW) & (positions <= HIGH))
    assert np.all(speed <= factor * np.array(LIMITS["speed"]) * (1 + 1e-6))
    largest = factor * np.array(LIMITS["acceleration"])
    assert np.all((acceleration > 0.95 * largest) & (acceleration < 1.0001 * largest))


def test_a_moving_average_limits_the_jerk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(axis_moves, "SMOOTHING", (0.75, 0.75))
    _, acceleration = rates(motion(kind_of("axis_moves", **LIMITS), JOINTS, 3, 1.0, FINE))
    jerk = np.abs(np.diff(acceleration, axis=0)).max(axis=0) / STEP
    limits = np.array(LIMITS["acceleration"])
    # over its length, the average sees a change from minus to plus the limit at most
    assert np.all(jerk < 1.001 * 2 * limits**2 / np.array(LIMITS["speed"]) / 0.75)


def test_axes_rest_and_move_on_their_own() -> None:
    speed, _ = rates(motion(kind_of("axis_moves", **LIMITS), JOINTS, 5, 1.0, FINE))
    rests = np.abs(speed) < 1e-9
    assert np.all((rests.mean(axis=0) > 0.05) & (rests.mean(axis=0) < 0.8))
    assert 0 < np.mean(rests.sum(axis=1) == 1) < 1


def test_without_breaks_each_move_ends_at_rest_and_stays_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, value in {"BROKEN": 0.0, "RESTS": 1.0, "REST": (2.0, 2.0)}.items():
        monkeypatch.setattr(axis_moves, name, value)
    speed, _ = rates(motion(kind_of("axis_moves", **LIMITS), JOINTS, 5, 1.0, FINE))
    turning = np.diff(np.sign(np.where(np.abs(speed) < 1e-9, 0, speed)), axis=0)
    assert np.all(np.abs(turning) <= 1)  # no axis turns back without a rest


def test_an_angle_turns_without_end() -> None:
    far = kind_of("axis_moves", speed=[8.0], acceleration=[20.0])
    inputs = motion(far, ANGLE, 4, 1.0, FINE)
    np.testing.assert_allclose(np.hypot(*inputs.T), 1.0, rtol=1e-12)
    angle = np.unwrap(np.arctan2(inputs[:, 1], inputs[:, 0]))
    speed, _ = rates(angle)
    assert np.ptp(angle) > 4 * np.pi
    assert 7.9 < np.abs(speed).max() <= 8.0 * (1 + 1e-6)


@pytest.mark.parametrize("count", [1, 4])
def test_held_set_points_are_those_of_a_slower_clock(count: int) -> None:
    slow = kind_of("axis_moves", **LIMITS, hold=[count, count])
    time = 0.01 * np.arange(2001)
    held = motion(slow, JOINTS, 6, 1.0, time)
    changes = np.flatnonzero(np.abs(np.diff(held, axis=0)).max(axis=1) > 0) + 1
    assert len(changes) > 200
    assert len(set(changes % count)) == 1  # all axes jump together, with the slower clock
    largest = np.abs(np.diff(held, axis=0)).max(axis=0)
    reach = 0.01 * count * np.array(LIMITS["speed"])
    assert np.all((largest > 0.9 * reach) & (largest <= reach * (1 + 1e-6)))


def test_the_slower_clock_is_drawn_for_each_trajectory() -> None:
    slow = kind_of("axis_moves", **LIMITS, hold=[2, 5])
    time, found = 0.01 * np.arange(1001), set()
    for seed in range(12):
        held = motion(slow, JOINTS, seed, 1.0, time)
        found.add(int(np.diff(np.flatnonzero(np.abs(np.diff(held, axis=0)).max(axis=1))).min()))
    assert found == {2, 3, 4, 5}


def test_limits_that_are_not_one_for_each_axis_are_refused() -> None:
    with refused(ValueError, "speed has 4 values", "expected 3", "'q1', 'q2'"):
        kind_of("axis_moves", **LIMITS).check(JOINTS[:3])
    with refused(ValueError, "acceleration has 2 values", "expected 1", "x and y"):
        kind_of("axis_moves", speed=[8.0], acceleration=[20.0, 20.0]).check(ANGLE)
