"""The noise floor of residuals and repeats, beside noise of known size."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy.signal

from slide_fmu.core.noise_floor import noise_of_residuals
from slide_fmu.core.signals import FloatArray

KNOWN = 0.05
"""RMS of the noise."""
CLOSE = 0.05
"""Estimates lie so close to what is true, relative to it."""


def white(seed: int, *shape: int) -> FloatArray:
    return KNOWN * np.random.default_rng(seed).normal(size=shape)


def slow(seed: int, samples: int, size: float) -> FloatArray:
    """An error that follows slow inputs through an oscillation, shape (samples, 1)."""
    drive = np.random.default_rng(seed).normal(size=samples)
    answer = scipy.signal.lfilter([1.0], [1.0, -1.8, 0.9], drive)
    return (size * answer / answer.std())[:, None]


@pytest.mark.parametrize("samples", [[4000], [1000, 3000, 1500], [400] * 20])
@pytest.mark.parametrize("seed", range(3))
def test_white_residuals_are_noise(samples: list[int], seed: int) -> None:
    found = noise_of_residuals([white(100 * seed + k, n, 2) for k, n in enumerate(samples)])
    assert found.floor == pytest.approx([KNOWN, KNOWN], rel=CLOSE)
    assert found.share == pytest.approx([1.0, 1.0], abs=2 * CLOSE)


@pytest.mark.parametrize("size", [0.2 * KNOWN, KNOWN, 3 * KNOWN])
@pytest.mark.parametrize("seed", range(3))
def test_slow_errors_beside_the_noise_are_told_from_it(size: float, seed: int) -> None:
    parts = [white(seed + k, 5000, 1) + slow(10 + seed + k, 5000, size) for k in (0, 50)]
    found = noise_of_residuals(parts)
    assert found.floor == pytest.approx([KNOWN], rel=CLOSE)
    assert found.total == pytest.approx([np.hypot(KNOWN, size)], rel=CLOSE)


def test_errors_without_noise_have_hardly_a_floor() -> None:
    found = noise_of_residuals([slow(1, 8000, 1.0)])
    assert found.floor[0] < 0.1 * found.total[0]


def test_constant_offset_is_neither() -> None:
    found = noise_of_residuals([white(4, 4000, 1) + 7.0])
    assert found.floor == pytest.approx([KNOWN], rel=CLOSE)
    assert found.total == pytest.approx([KNOWN], rel=CLOSE)


def test_residuals_of_zero_have_no_floor() -> None:
    found = noise_of_residuals([np.zeros((100, 2))])
    assert found.floor.tolist() == [0.0, 0.0]
    assert found.share.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("lengths", "shortest"), [([], 0), ([400, 15], 15)])
def test_too_few_residuals_are_refused(lengths: list[int], shortest: int) -> None:
    message = f"residuals of {len(lengths)} trajectories, the shortest of {shortest} samples"
    with pytest.raises(ValueError, match=re.escape(message)):
        noise_of_residuals([np.zeros((n, 1)) for n in lengths])
