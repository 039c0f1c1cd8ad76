"""Measures of trust against brute force, and against numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.core.measures import best_constant
from slide_fmu.validation.trust import deviation_of, rank_correlation

LEVELS = np.linspace(0.01, 8, 4000)
"""Constants that brute force tries."""


def errors_of(seed: int, count: int = 400) -> np.ndarray:
    return np.random.default_rng(seed).lognormal(0, 0.7, count)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_best_constant_deviates_least_of_all_constants(seed: int) -> None:
    errors = errors_of(seed)

    def deviation(constant: float) -> float:
        return float(np.mean(np.abs(constant - errors) / errors))

    found = best_constant(errors)
    assert found in errors
    assert deviation(found) <= min(map(deviation, LEVELS)) + 1e-12
    assert deviation(found) < deviation(float(np.median(errors)))


def test_best_constant_of_one_error_is_that_error() -> None:
    assert best_constant(np.array([0.3])) == 0.3


def plain_ranks(values: np.ndarray) -> np.ndarray:
    """Mean ranks, those of equal values shared, counted one by one."""
    less = (values[None] < values[:, None]).sum(axis=1)
    same = (values[None] == values[:, None]).sum(axis=1)
    return np.asarray(less + 0.5 * (same + 1))


def test_rank_correlation_is_the_correlation_of_ranks_with_ties() -> None:
    rng = np.random.default_rng(5)
    one = rng.integers(0, 30, 200).astype(float)
    other = np.exp(one / 10) + rng.integers(0, 5, 200)
    expected = np.corrcoef(plain_ranks(one), plain_ranks(other))[0, 1]
    assert rank_correlation(one, other) == pytest.approx(expected)
    assert rank_correlation(one, one**3) == pytest.approx(1)
    assert rank_correlation(one, -one) == pytest.approx(-1)


def test_rank_correlation_with_a_constant_is_not_known() -> None:
    varied = np.arange(3.0)
    assert rank_correlation(varied, np.ones(3)) is None
    assert rank_correlation(np.ones(3), varied) is None


def test_estimate_figures_stand_beside_the_best_constant_without_errors_of_zero() -> None:
    errors = np.array([0.0, 1.0, 2.0, 4.0])
    estimates = np.array([9.0, 1.5, 2.0, 3.0])
    found = deviation_of(estimates, errors)
    deviations = [0.5, 0.0, 0.25]
    assert found.mean == pytest.approx(np.mean(deviations))
    assert found.p95 == pytest.approx(np.quantile(deviations, 0.95))
    # weights 1, 1/2, 1/4: half of their sum is reached at the first
    assert best_constant(errors[1:]) == 1
    assert found.constant_mean == pytest.approx((0.5 + 0.75) / 3)
    assert found.constant_p95 == pytest.approx(np.quantile([0.0, 0.5, 0.75], 0.95))
    assert found.rank_correlation == pytest.approx(1)


def test_estimate_figures_say_how_often_and_how_far_an_estimate_was_too_small() -> None:
    errors = np.array([0.0, 1.0, 2.0, 2.1, 8.0])
    found = deviation_of(np.array([0.0, 2.0, 1.0, 1.0, 1.0]), errors)
    assert found.too_small_share == 2 / 4  # twice the estimate is not more than twice of it
    assert found.too_small_factor == pytest.approx(np.quantile([0.5, 2.0, 2.1, 8.0], 0.95))
