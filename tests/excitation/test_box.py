"""Constant inputs at the corners of the box of their ranges, and inside of it."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.excitation.box import at_points, corners_of_box, points_inside
from tests.excitation.drawn import kind_of, motion
from tests.refusals import refused

TANKS = (Signal("pump", "L/min", 1.0, 8.0), Signal("valve", "1", 0.2, 1.0))
BOX = kind_of("box", duration=[2.0, 5.0], ramp=[0.05, 1.0])
TIME = 0.01 * np.arange(20001)


def test_all_corners_are_held_and_nothing_leaves_the_ranges() -> None:
    inputs = motion(BOX, TANKS, 1, time=TIME)
    still = np.all(np.diff(inputs, axis=0) == 0, axis=1)
    held = inputs[1:][still]
    for corner in at_points(TANKS, corners_of_box(2)):
        samples = np.sum(np.all(np.isclose(held, corner, rtol=1e-12), axis=1))
        assert samples > 100, corner
    inside = np.all((held > [1.01, 0.21]) & (held < [7.99, 0.99]), axis=1)
    assert inside.mean() > 0.2
    assert still.mean() > 0.6
    assert np.all(inputs >= [1.0 - 1e-12, 0.2 - 1e-12])
    assert np.all(inputs <= [8.0 + 1e-12, 1.0 + 1e-12])


def test_ways_are_slow_and_fast() -> None:
    inputs = motion(BOX, TANKS, 2, time=TIME)
    still = np.all(np.diff(inputs, axis=0) == 0, axis=1)
    rests = np.flatnonzero(still)
    ways = 0.01 * (np.diff(rests)[np.diff(rests) > 1] - 1)
    assert ways.min() < 0.15
    assert ways.max() > 0.5


def test_factor_moves_points_towards_the_middle() -> None:
    inputs = motion(BOX, TANKS, 3, factor=0.5, time=TIME)
    assert inputs[:, 0].max() == pytest.approx(6.25)
    assert inputs[:, 0].min() == pytest.approx(2.75)


def test_corners_of_many_inputs_are_a_part_in_which_each_is_low_and_high() -> None:
    assert len(corners_of_box(4)) == 16
    some = corners_of_box(6)
    assert some.shape == (16, 6)
    assert np.all(np.abs(some.sum(axis=0)) <= 4)
    assert len(np.unique(some, axis=0)) > 12
    assert np.all(np.abs(points_inside(3, 8)) <= 1)


def test_angles_have_no_corners() -> None:
    turning = (
        Signal("x", "1", -1.0, 1.0, angle="cosine"),
        Signal("y", "1", -1.0, 1.0, angle="sine"),
    )
    with refused(ValueError, "cosine and sine"):
        BOX.check(turning)
