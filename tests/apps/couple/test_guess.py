"""Linked inputs of an implicit step are continued from those of the steps before it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from slide_fmu.apps.couple.component import StepOutputs
from slide_fmu.apps.couple.loop import Loop, Mix
from slide_fmu.core.signals import FloatArray

LENGTHS = [0.1, 0.2, 0.05, 0.1, 0.1]


def guesses(course: Callable[[float], float], held: bool) -> FloatArray:
    """Solve steps of uneven lengths for one linked input, and return all errors of the guesses."""
    one = np.ones(1)
    mix = Mix(0 * one, float(held) * one, float(not held) * one)
    begin = np.array([course(0.0)])
    loop = Loop([], [], [0], [], np.array([held]), mix, one, one, begin.copy(), begin.copy())
    time, errors = 0.0, []
    for length in LENGTHS:
        at = time + (0.5 if held else 1.0) * length
        errors.append(float(loop.guess(length)[0]) - course(at))
        end, now = np.array([course(time + length)]), np.array([course(at)])
        loop.accept(StepOutputs(now, end), now, now, length)
        time += length
    return np.array(errors)


@pytest.mark.parametrize("held", [True, False])
def test_parabola_is_continued_once_three_steps_are_known(held: bool) -> None:
    errors = guesses(lambda t: 2.0 - 3.0 * t + 4.0 * t**2, held)
    assert np.abs(errors[3:]).max() < 1e-12
    assert np.abs(errors[:3]).min() > 1e-3


@pytest.mark.parametrize("held", [True, False])
def test_straight_line_is_continued_once_one_step_is_known(held: bool) -> None:
    errors = guesses(lambda t: 2.0 - 3.0 * t, held)
    assert np.abs(errors[1:]).max() < 1e-12
    assert abs(errors[0]) > 1e-3
