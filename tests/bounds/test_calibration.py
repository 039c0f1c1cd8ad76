"""Bounds are calibrated by trajectory, with floors, disagreement and tolerances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from crepes import ConformalRegressor

from slide_fmu.bounds.calibration import (
    conformal_factors,
    domain_limits,
    factors_of,
    floors_of,
    scales_of,
    shares_of,
)
from slide_fmu.bounds.observations import Observations, thinned
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.error_bound import CONFIDENCES, NO_BOUND
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape
from tests.refusals import refused

ALIKE = np.zeros(120, dtype=np.int64)
"""All trajectories of a calibration are of one kind of input."""

SHAPE = Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape())


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


def test_few_trajectories_with_large_errors_do_not_raise_thefloors_of() -> None:
    rng = np.random.default_rng(6)
    errors = rng.uniform(0, 1, (50, 40, 2))
    other = np.zeros((50, 40, 1))
    alike = floors_of(Observations(other, other, errors, errors))
    np.testing.assert_allclose(alike, 0.15 * 0.95, rtol=0.02)
    errors[:10, :, 1] *= 1000
    few = floors_of(Observations(other, other, errors, errors))
    np.testing.assert_allclose(few, [alike[0], 0.45 * 0.95], rtol=0.02)


def test_share_of_the_disagreement_is_the_part_that_the_surrogate_errs() -> None:
    """A companion that is three times less accurate makes most of the disagreement."""
    rng = np.random.default_rng(7)
    errors = np.abs(rng.normal(size=(50, 200, 2)))
    apart = np.abs(errors + rng.normal(size=errors.shape) * [3.0, 0.0])
    other = np.zeros((50, 200, 1))
    seen = Observations(other, other, apart, errors)
    found = shares_of(seen)
    np.testing.assert_allclose(found, [1 / np.sqrt(10), 1.0], rtol=0.1)
    np.testing.assert_array_equal(seen.weighed(found).disagreement, found * apart)


def test_factors_cover_the_calibration_together_with_floors_and_disagreement() -> None:
    """They are the least ones that do: a sample below floor or disagreement needs none."""
    rng, bound = np.random.default_rng(4), bounded_surrogate(SHAPE).bound
    assert bound is not None
    statistics = rng.normal(size=(120, 50, bound.head.n_channels))
    scales = scales_of(bound.head, statistics)
    errors = scales * np.abs(rng.normal(size=scales.shape)) * rng.uniform(0, 2, scales.shape)
    disagreement = errors * rng.uniform(0, 1.3, scales.shape)
    seen = Observations(statistics, statistics, disagreement, errors)
    floors = np.array([0.0, 0.5]) * seen.usual_errors()
    factors = factors_of(bound.head, floors, seen, ALIKE)
    assert (np.diff(factors, axis=0) > 0).all()

    def covered(of: FloatArray) -> FloatArray:
        found = np.maximum(np.hypot(of * scales, floors), disagreement)
        return np.asarray((errors <= found).mean(axis=(0, 1)))

    for factor, confidence in zip(factors, CONFIDENCES, strict=True):
        wanted = confidence * 121 / 120
        assert (covered(factor * (1 + 1e-9)) >= wanted).all()
        assert (covered(factor * (1 - 1e-9)) < wanted).all()
    alone = factors_of(bound.head, np.zeros(2), replace(seen, disagreement=0.0 * errors), ALIKE)
    assert (factors < alone).all()


def test_few_trajectories_give_no_bound_of_99_percent_and_fewer_none_at_all() -> None:
    rng, bound = np.random.default_rng(8), bounded_surrogate(SHAPE).bound
    assert bound is not None
    for count in (20, 99, 100):
        statistics = rng.normal(size=(count, 30, bound.head.n_channels))
        errors = rng.uniform(0, 1, (count, 30, 2))
        seen = Observations(statistics, statistics, 0.0 * errors, errors)
        found = factors_of(bound.head, np.zeros(2), seen, ALIKE[:count])
        assert (found[:2] < NO_BOUND).all()
        assert (found[2] == NO_BOUND).all() == (count < 100)
    few = Observations(*(part[:19] for part in (statistics,) * 2), 0.0 * errors[:19], errors[:19])
    with refused(ValueError, "with 19 trajectories", "at least 20"):
        factors_of(bound.head, np.zeros(2), few, ALIKE[:19])


def test_common_kinds_are_covered_nearly_as_often_as_all_samples() -> None:
    """One kind in three has errors that are three times as large as the head expects."""
    rng, bound = np.random.default_rng(6), bounded_surrogate(SHAPE).bound
    assert bound is not None
    statistics = rng.normal(size=(120, 50, bound.head.n_channels))
    scales, kinds = scales_of(bound.head, statistics), np.arange(120) % 3
    errors = scales * np.abs(rng.normal(size=scales.shape))
    errors[kinds == 2] *= 3.0
    seen = Observations(statistics, statistics, 0.0 * errors, errors)
    alike, apart = (factors_of(bound.head, np.zeros(2), seen, of) for of in (ALIKE, kinds))
    covered = (errors <= alike[1] * scales)[kinds == 2].mean(axis=(0, 1))
    assert (covered < 0.9).all()
    covered = (errors <= apart[1] * scales)[kinds == 2].mean(axis=(0, 1))
    np.testing.assert_allclose(covered, 0.92 * 41 / 40, atol=2e-3)
    rare = np.where(np.arange(120) < 105, 0, kinds)  # too few trajectories to say anything
    np.testing.assert_array_equal(factors_of(bound.head, np.zeros(2), seen, rare)[1], alike[1])


def test_factors_rise_where_a_kind_counts_for_the_lowest_confidence_alone() -> None:
    """A kind has enough trajectories for 90 %, too few for 95 %, and far larger errors."""
    rng, bound = np.random.default_rng(7), bounded_surrogate(SHAPE).bound
    assert bound is not None
    statistics = rng.normal(size=(120, 50, bound.head.n_channels))
    scales, kinds = scales_of(bound.head, statistics), (np.arange(120) >= 100).astype(np.int64)
    errors = scales * np.abs(rng.normal(size=scales.shape))
    errors[kinds == 1] *= 20.0
    seen = Observations(statistics, statistics, 0.0 * errors, errors)
    alike, apart = (factors_of(bound.head, np.zeros(2), seen, of) for of in (ALIKE, kinds))
    assert (apart[0] > alike[1]).all()
    replace(bound, factors=apart)  # it refuses factors that fall


def test_where_the_disagreement_covers_everything_the_head_counts_half() -> None:
    rng, bound = np.random.default_rng(5), bounded_surrogate(SHAPE).bound
    assert bound is not None
    statistics = rng.normal(size=(120, 50, bound.head.n_channels))
    errors = rng.uniform(0, 1, (120, 50, 2))
    seen = Observations(statistics, statistics, errors, errors)
    factors = factors_of(bound.head, np.zeros(2), seen, ALIKE)
    alone = factors_of(bound.head, np.zeros(2), replace(seen, disagreement=0.0 * errors), ALIKE)
    np.testing.assert_allclose(factors, 0.5 * alone)
    assert (np.diff(factors, axis=0) > 0).all()


@pytest.mark.parametrize(
    ("most", "every"), [(1e9, 1), (240.0, 1), (239.0, 2), (25.0, 10), (0.1, 50)]
)
def test_every_nth_sample_of_further_kinds_counts(most: float, every: int) -> None:
    rng = np.random.default_rng(2)
    mix = Observations(*(rng.normal(size=(4, 30, count)) for count in (5, 3, 2, 2)))
    found = thinned(mix, most)
    for name, values in vars(mix).items():
        np.testing.assert_array_equal(getattr(found, name), values[:, ::every])
    assert found.errors.shape[1] >= 1


def test_value_at_which_an_input_rests_again_and_again_is_in_the_domain() -> None:
    """The last digits of another rest do not leave the domain, a tenth more does."""
    rng = np.random.default_rng(2)
    learnt, calibration = 1 - 1e-4 * rng.uniform(size=(2, 20, 50, 1))
    (limit,) = domain_limits(learnt, calibration, 0.002)
    assert 1 < limit < 1.1**2
