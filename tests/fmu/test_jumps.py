"""Inputs that move and jump: an FMU that is called between samples knows better when they did."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import FORGETFUL, go
from tests.fmu.moving_inputs import forecasting
from tests.fmu.native import Load
from tests.fmu.samples import Shape, random_surrogate

SHAPE = Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL, hold="first_order")
RESTS, AFTER = 40, 12
"""Samples before a jump and after the first one that has it."""
FINE = 1200
"""Points of integrals over a sample step: a multiple of all parts."""


def jumping(jumps: bool) -> Surrogate:
    """A surrogate with a forecast, whose inputs jumped in the training, or did not."""
    surrogate = forecasting(random_surrogate(SHAPE))
    assert surrogate.forecast is not None
    forecast = dataclasses.replace(surrogate.forecast, jumps=jumps)
    return dataclasses.replace(surrogate, forecast=forecast)


def made_up_for(parts: int, late: int) -> tuple[float, float]:
    """What the second and third sample get of a jump by 1, of which the first one is the first.

    A jump lasts a communication step, 1 / parts long, which ends so many of these before the first
    sample. Straight lines through all samples shall have the same integral as the jump, and the
    same first moment.
    """
    time = np.arange(0, 6 * FINE + 1) / FINE  # the first sample is at 2
    end = 2 - late / parts
    jump = np.clip(1 + (time - end) * parts, 0, 1)

    def lines(samples: list[float]) -> FloatArray:
        return np.interp(time, np.arange(7), samples)

    def moments(values: FloatArray) -> FloatArray:
        return np.array([np.trapezoid(values, time), np.trapezoid(values * time, time)])

    second, third = (moments(lines(np.eye(7)[i].tolist())) for i in (3, 4))
    lack = moments(jump) - moments(lines([0, 0, 1, 1, 1, 1, 1]))
    found = np.linalg.solve(np.stack([second, third], axis=1), lack)
    return float(found[0]), float(found[1])


def inputs(surrogate: Surrogate, values: list[float]) -> FloatArray:
    """Scaled values of the first input, of which the second rests, in their units."""
    scaled = np.stack([values, np.full(len(values), 0.2)], axis=1)
    return np.asarray(surrogate.input_scaling.invert(scaled))


def called(load: Load, surrogate: Surrogate, parts: int, late: int) -> FloatArray:
    """Outputs at the samples from the fifth one after the jump on, from -0.4 to 0.5."""
    count = (RESTS + AFTER) * parts
    before = RESTS * parts - late  # the input is set so many steps before the first sample
    rows = inputs(surrogate, [-0.4] * before + [0.5] * (count - before))
    found = go(load(surrogate).instance(held=False).start(), [1 / parts] * count, rows, 2)
    return found[parts - 1 :: parts][RESTS + 4 :]


def expected(surrogate: Surrogate, more: tuple[float, float]) -> FloatArray:
    """The same from samples of which two have more of the jump."""
    values = [-0.4] * RESTS + [0.5] * AFTER
    for i, part in enumerate(more):
        values[RESTS + 1 + i] += 0.9 * part
    found: FloatArray = surrogate.predict_newest(inputs(surrogate, [*values, 0.5]))
    return found[RESTS + 5 : RESTS + 5 + AFTER - 4]


@pytest.mark.parametrize(("parts", "late"), [(2, 0), (2, 1), (4, 0), (4, 1), (4, 3), (10, 8)])
def test_samples_after_a_jump_make_up_for_the_line_through_it(
    load: Load, parts: int, late: int
) -> None:
    """It had ended so many communication steps before a sample."""
    surrogate = jumping(True)
    right = expected(surrogate, made_up_for(parts, late))
    plain = expected(surrogate, (0, 0))
    found = called(load, surrogate, parts, late)
    assert np.abs(plain - right).max() > 1e-3
    np.testing.assert_allclose(found, right, rtol=0, atol=2e-5)


def test_jump_in_a_whole_step_stays_a_line_as_in_the_training(load: Load) -> None:
    surrogate = jumping(True)
    found = called(load, surrogate, 1, 0)
    np.testing.assert_allclose(found, expected(surrogate, (0, 0)), atol=2e-5)


def test_training_without_jumps_leaves_samples_as_they_are(load: Load) -> None:
    surrogate = jumping(False)
    found = called(load, surrogate, 4, 1)
    np.testing.assert_allclose(found, expected(surrogate, (0, 0)), atol=2e-5)
