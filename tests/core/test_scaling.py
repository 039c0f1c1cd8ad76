"""Scalings come in pairs that invert each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.scaling import Affine, LogError
from tests.refusals import refused
from tests.strategies import affines, log_errors, numbers

ROUNDING = 1e-12
"""A handful of float64 roundings."""
SMALLEST = float(np.finfo(np.float64).smallest_subnormal)
"""Scaled values below the smallest number of all are rounded to it, or to zero."""


@given(affines(), st.lists(numbers, min_size=1, max_size=4))
def test_affine_inverts(scaling: Affine, values: list[float]) -> None:
    physical = np.tile(np.array(values)[:, None], len(scaling.scale))
    again = scaling.invert(scaling.apply(physical))
    size = np.abs(physical) + np.abs(scaling.offset)
    assert np.all(np.abs(again - physical) <= ROUNDING * size + SMALLEST * (1 + scaling.scale))


def test_affine_is_right_in_an_example_by_hand() -> None:
    scaling = Affine.of_channels([1.0, 10.0], [2.0, 5.0])
    assert scaling.apply(np.array([[3.0, 0.0]])).tolist() == [[1.0, -2.0]]
    assert scaling.invert(np.array([[1.0, -2.0]])).tolist() == [[3.0, 0.0]]


@given(log_errors())
def test_log_error_maps_the_ends_to_minus_one_and_one(scaling: LogError) -> None:
    """Also for high != 0, where the printed formula of the paper is wrong."""
    ends = 10.0 ** np.array([scaling.low, scaling.high])
    assert scaling.apply(ends) == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert scaling.invert(np.array([-1.0, 1.0])) == pytest.approx(ends, rel=1e-9)


@given(log_errors(), st.floats(-2, 2))
def test_log_error_inverts(scaling: LogError, eps: float) -> None:
    assert scaling.apply(scaling.invert(np.array(eps))) == pytest.approx(eps, abs=1e-9)


def test_log_error_is_right_in_an_example_by_hand() -> None:
    scaling = LogError(-4.0, -2.0)
    assert scaling.apply(np.array([1e-4, 1e-3, 1e-2])) == pytest.approx([-1.0, 0.0, 1.0])


@pytest.mark.parametrize("scale", [0.0, -1.0])
def test_affine_scale_is_positive(scale: float) -> None:
    with pytest.raises(ValueError, match=f"scale .*{scale}.*expected positive"):
        Affine.of_channels([0.0, 0.0], [1.0, scale])


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_affine_is_finite(value: float) -> None:
    with refused(ValueError, "not finite"):
        Affine.of_channels([value], [1.0])
    with refused(ValueError, "not finite"):
        Affine.of_channels([0.0], [value])


def test_affine_shapes_fit() -> None:
    with refused(ValueError, "shape (1,)"):
        Affine.of_channels([0.0, 1.0], [1.0])
    with refused(ValueError, "one-dimensional"):
        Affine.of_channels([[0.0]], [[1.0]])


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.0), (1.0, -1.0), (-math.inf, 0.0)])
def test_log_error_needs_a_range(low: float, high: float) -> None:
    with refused(ValueError, "low < high"):
        LogError(low, high)
