"""Autoregressive models of noise whose spectrum is known."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from slide_fmu.core.autoregression import MOST_ORDER, autocovariances, fit_autoregression
from slide_fmu.core.signals import FloatArray
from tests.refusals import refused

POLES = 0.98 * np.exp(0.4j), 0.98 * np.exp(-0.4j)
COEFFICIENTS = -np.poly(POLES).real[1:]
"""n[k] = 1.806 n[k-1] - 0.960 n[k-2] + e[k]."""
MANY = 100_000
SAMPLING = 0.01
"""Coefficients are known so well from so many samples: some deviations of 1 / sqrt(MANY)."""


def coloured(samples: int = MANY, seed: int = 0) -> FloatArray:
    """Noise of two poles, of which the start has decayed, from white noise of deviation 2."""
    white = 2.0 * np.random.default_rng(seed).normal(size=samples + 1000)
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, *-COEFFICIENTS], white)[1000:])


def test_order_and_coefficients_are_those_of_the_noise() -> None:
    found = fit_autoregression([coloured()])
    assert found.order == 2
    assert found.predictors[2] == pytest.approx(COEFFICIENTS, abs=SAMPLING)
    assert found.variances[2] == pytest.approx(4.0, rel=SAMPLING)
    assert found.variances[0] == pytest.approx(coloured().var(), rel=1e-12)
    assert found.unpredictable == pytest.approx(2.0 / coloured().std(), rel=SAMPLING)


def test_white_noise_has_order_zero_and_is_unpredictable() -> None:
    found = fit_autoregression([np.random.default_rng(0).normal(3.0, 1.0, 5000)])
    assert (found.order, found.predictors.shape, found.unpredictable) == (0, (1, 0), 1.0)


def test_predictors_of_all_orders_solve_the_equations_of_yule_and_walker() -> None:
    noise = coloured(2000)
    found, covariances = fit_autoregression([noise]), autocovariances([noise], MOST_ORDER)
    for order in range(1, found.order + 1):
        wanted = scipy.linalg.solve_toeplitz(covariances[:order], covariances[1 : order + 1])
        assert found.predictors[order, :order] == pytest.approx(wanted, rel=1e-9)
        assert not found.predictors[order, order:].any()
        left = covariances[0] - wanted @ covariances[1 : order + 1]
        assert found.variances[order] == pytest.approx(left, rel=1e-9)


def test_pieces_of_a_noise_tell_what_the_whole_tells() -> None:
    noise = coloured()
    whole, found = fit_autoregression([noise]), fit_autoregression(np.split(noise, 20))
    # a few products of neighbours are lost at the ends of pieces
    assert found.variances[2] == pytest.approx(whole.variances[2], rel=0.1)
    assert found.predictors[2, :2] == pytest.approx(COEFFICIENTS, abs=0.05)


def test_pieces_shorter_than_the_longest_predictor_are_no_mistake() -> None:
    noise = np.random.default_rng(0).normal(size=30)
    covariances = autocovariances([noise[:3], noise[3:]], MOST_ORDER)
    assert covariances[0] == pytest.approx(noise.var())
    assert np.linalg.eigvalsh(scipy.linalg.toeplitz(covariances)).min() > 0


def test_floor_adds_white_noise() -> None:
    plain, raised = (fit_autoregression([coloured()], floor) for floor in (0.0, 20.0))
    assert raised.variances[0] == pytest.approx(plain.variances[0] + 400.0)
    assert raised.unpredictable > plain.unpredictable
    constant = fit_autoregression([np.ones(500)], 0.5)
    assert (constant.order, constant.variances.tolist()) == (0, [0.25])


@pytest.mark.parametrize("stretches", [[], [np.zeros(0)], [np.ones(100)]])
def test_what_has_no_noise_is_refused(stretches: list[FloatArray]) -> None:
    with refused(ValueError, "expected some noise", "deviation of"):
        fit_autoregression(stretches)
