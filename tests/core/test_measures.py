"""Measures of error, against what their names say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slide_fmu.core.measures import moving_rms, rms


def test_rms_is_that_of_each_channel() -> None:
    values = np.array([[3.0, 1.0], [4.0, -1.0]])
    assert rms(values) == pytest.approx([math.sqrt(12.5), 1.0])
    assert rms(np.stack([values, values])) == pytest.approx([math.sqrt(12.5), 1.0])


@pytest.mark.parametrize("length", [1, 3, 10])
def test_moving_rms_is_the_explicit_loop(length: int) -> None:
    errors = np.random.default_rng(0).normal(size=(10, 2))
    found = moving_rms(errors, length)
    assert found.shape == (11 - length, 2)
    for row in range(11 - length):
        for channel in range(2):
            part = [errors[row + k, channel] ** 2 for k in range(length)]
            assert found[row, channel] == pytest.approx(math.sqrt(sum(part) / length))
