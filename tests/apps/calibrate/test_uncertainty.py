"""The uncertainty of a fit, beside a linear fit whose covariance is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from slide_fmu.apps.calibrate.uncertainty import (
    MOST_BLOCKS,
    correlation_time,
    uncertainty_of,
)
from slide_fmu.core.signals import FloatArray

SAMPLES = 4000
QUANTILE = student.ppf(0.975, MOST_BLOCKS - 1)


def noise(colour: float, seed: int = 0) -> FloatArray:
    white = np.random.default_rng(seed).normal(size=SAMPLES) * np.sqrt(1 - colour**2)
    return np.asarray(lfilter([1.0], [1.0, -colour], white))[:, None]


def mean_of(values: FloatArray) -> float:
    """Half of the interval of a mean: its derivative is 1 at every sample."""
    off = values - values.mean(axis=0)
    found = uncertainty_of(off, np.ones((len(values), 1, 1)), 0.0)
    return float(found.half_widths[0])


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.95])
def test_mean_of_coloured_noise_is_as_uncertain_as_theory_says(colour: float) -> None:
    """Its variance is (1 + c) / (1 - c) / N; that of a jackknife varies by a third."""
    expected = QUANTILE * np.sqrt((1 + colour) / (1 - colour) / SAMPLES)
    found = [mean_of(noise(colour, seed)) for seed in range(20)]
    assert np.mean(found) == pytest.approx(expected, rel=0.25)


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.95])
def test_correlation_time_is_that_of_the_noise(colour: float) -> None:
    found = np.mean([correlation_time(noise(colour, seed)) for seed in range(10)])
    assert found == pytest.approx((1 + colour) / (1 - colour), rel=0.3)


def test_noise_that_remembers_as_long_as_the_record_is_said_to_be_too_short() -> None:
    slopes = np.ones((SAMPLES, 1, 1))
    assert not uncertainty_of(noise(0.5), slopes, 0.0).short
    assert uncertainty_of(noise(0.999), slopes, 0.0).short


def test_own_error_counts_as_if_it_looked_like_the_parameter() -> None:
    """An error of e at every sample, all of the sign of the derivative s, moves a fit by e / s."""
    slopes = np.full((SAMPLES, 1, 1), 4.0)
    found = uncertainty_of(0 * noise(0.0), slopes, own_error=SAMPLES * 20.0**2)
    assert found.half_widths[0] == pytest.approx(20.0 / 4.0, rel=1e-3)


def test_parameters_of_the_same_effect_are_correlated_and_open() -> None:
    one = np.random.default_rng(1).normal(size=(SAMPLES, 1, 1))
    alike = np.concatenate([one, one], axis=-1)
    found = uncertainty_of(noise(0.0), alike, 0.0)
    assert found.correlation[0, 1] == pytest.approx(-1.0, abs=1e-6)
    assert (found.half_widths > 100).all()
