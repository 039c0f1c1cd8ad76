"""Conformal calibration by trajectory."""

from __future__ import annotations

import numpy as np
import pytest
from crepes import ConformalRegressor

from slide_fmu.bounds.error_bound import conformal_factors


def test_factor_covers_the_share_with_its_correction() -> None:
    ratios = np.random.default_rng(0).exponential(size=(40, 50, 2)) * [1, 3]
    factors = conformal_factors(ratios, 0.9)
    shares = (ratios <= factors).mean(axis=(0, 1))
    assert np.all(shares >= 0.9 * 41 / 40)
    assert np.all((ratios < factors).mean(axis=(0, 1)) < 0.9 * 41 / 40)


def test_further_trajectories_are_covered_on_average() -> None:
    """Trajectories differ in their level, so samples of one are far from independent."""
    rng = np.random.default_rng(1)
    shares = []
    for _ in range(300):
        levels = rng.lognormal(sigma=0.5, size=(61, 1, 1))
        ratios = levels * np.abs(rng.normal(size=(61, 30, 1)))
        factor = conformal_factors(ratios[:60], 0.9)
        shares.append((ratios[60] <= factor).mean())
    assert 0.9 - 0.01 < np.mean(shares) < 0.95


@pytest.mark.parametrize(("confidence", "least"), [(0.9, 10), (0.95, 20), (0.99, 100)])
def test_too_few_trajectories_are_refused(confidence: float, least: int) -> None:
    ratios = np.ones((least - 1, 5, 1))
    with pytest.raises(ValueError, match=f"expected at least {least}: raise data.calibration"):
        conformal_factors(ratios, confidence)
    assert conformal_factors(np.ones((least, 5, 1)), confidence) == 1


@pytest.mark.parametrize("confidence", [0.9, 0.95, 0.99])
@pytest.mark.parametrize("count", [104, 153, 250])
def test_factor_of_trajectories_of_one_sample_is_that_of_split_conformal_prediction(
    count: int, confidence: float
) -> None:
    """Then a sample is an observation, and crepes is an oracle of the normalised method.

    For none of these counts n is (1 - confidence) (n + 1) a whole number: rounding errors make
    crepes take the next larger score there.
    """
    rng = np.random.default_rng(count)
    errors, scales = rng.normal(size=(count, 2)), rng.lognormal(size=(count, 2))
    factors = conformal_factors(np.abs(errors / scales)[:, None], confidence)
    for output in range(2):
        oracle = ConformalRegressor().fit(errors[:, output], sigmas=scales[:, output])
        (interval,) = oracle.predict_int(np.zeros(1), sigmas=np.ones(1), confidence=confidence)
        np.testing.assert_allclose(interval, [-factors[output], factors[output]], rtol=1e-12)
