"""Inputs that move: the value set is u(t), the rest is forecast, the true sample takes its place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import ESTIMATE_TOLERANCE, LASTING, NAMES, PATTERNS, SHAPES
from tests.fmu.derivatives import ROUNDED, derivative, surrogate_of
from tests.fmu.moving_inputs import Moving, forecasting, moving_inputs
from tests.fmu.native import DISCARD, ERROR, OK, Load, Native
from tests.fmu.plain import five_point_slope
from tests.fmu.samples import STEP, Shape, random_surrogate, sum_surrogate
from tests.marks import essential

AT_STEP_END = 12_000_000


def moving(shape: Shape) -> Surrogate:
    return forecasting(random_surrogate(dataclasses.replace(shape, hold="first_order")))


def go(native: Native, surrogate: Surrogate, lengths: list[float], rows: FloatArray) -> FloatArray:
    found = []
    for length, row in zip(lengths, rows, strict=True):
        assert native.set(*row) == OK
        assert native.do_step(native.time(), length * STEP) == OK, native.messages
        found.append(native.get(len(surrogate.inputs), 2 * len(surrogate.outputs)))
    return np.array(found)


@pytest.mark.parametrize("pattern", essential({"whole": [1], "double": [2], **PATTERNS}, "whole"))
@pytest.mark.parametrize("shape", SHAPES, ids=NAMES)
def test_step_gives_the_window_of_the_true_past_and_of_the_forecast(
    load: Load, shape: Shape, pattern: str
) -> None:
    surrogate = moving(shape)
    lengths = ({"whole": [1.0], "double": [2.0], **PATTERNS}[pattern] * 60)[:60]
    rows, oracle = moving_inputs(surrogate, 60), Moving(surrogate)
    found = go(load(surrogate).instance().start(), surrogate, lengths, rows)
    n = len(surrogate.outputs)
    for k, (length, row) in enumerate(zip(lengths, rows, strict=True)):
        outputs, estimates = oracle.step(length * STEP, row).results()
        np.testing.assert_allclose(
            found[k, :n], outputs, rtol=0, atol=2 * OUTPUT_TOLERANCE * 8, err_msg=f"{k}"
        )
        np.testing.assert_allclose(found[k, n:], estimates, rtol=ESTIMATE_TOLERANCE)
