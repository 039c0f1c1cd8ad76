"""Measures of error, against what their names say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slide_fmu.core.measures import TINY, moving_rms, relative_rmse, rms, size_about
from slide_fmu.core.signals import FloatArray


def test_rms_is_that_of_each_channel() -> None:
    values = np.array([[3.0, 1.0], [4.0, -1.0]])
    assert rms(values) == pytest.approx([math.sqrt(12.5), 1.0])
    assert rms(np.stack([values, values])) == pytest.approx([math.sqrt(12.5), 1.0])


def test_error_is_relative_to_the_deviation_of_the_truth() -> None:
    truth = np.random.default_rng(0).normal(3.0, 2.0, size=(100, 2))
    error = np.random.default_rng(1).normal(size=(100, 2))
    np.testing.assert_array_equal(size_about(truth), truth.std(axis=0))
    np.testing.assert_array_equal(
        relative_rmse(error, size_about(truth)), rms(error) / truth.std(axis=0)
    )
    about_zero = relative_rmse(error, size_about(truth, np.zeros(2)))
    np.testing.assert_array_equal(about_zero, rms(error) / rms(truth))


@pytest.mark.parametrize("mean", [None, np.full(1, 0.1) * (1 + 1e-12)])
def test_error_of_a_constant_output_is_zero_or_huge_and_finite(mean: FloatArray | None) -> None:
    truth = np.full((1000, 1), 0.1)
    size = size_about(truth, mean)
    assert size == TINY
    assert relative_rmse(np.zeros((1000, 1)), size) == 0.0
    with np.errstate(all="raise"):
        for error in (1e-3, 1e3):
            relative = relative_rmse(np.full((1000, 1), error), size)
            assert 1e100 < relative < math.inf
    assert size_about(truth, np.zeros(1)) == pytest.approx(0.1)  # of a part of trajectories


@pytest.mark.parametrize("length", [1, 3, 10])
def test_moving_rms_is_the_explicit_loop(length: int) -> None:
    errors = np.random.default_rng(0).normal(size=(10, 2))
    found = moving_rms(errors, length)
    assert found.shape == (11 - length, 2)
    for row in range(11 - length):
        for channel in range(2):
            part = [errors[row + k, channel] ** 2 for k in range(length)]
            assert found[row, channel] == pytest.approx(math.sqrt(sum(part) / length))
