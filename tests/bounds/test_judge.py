"""A judge takes factors, limits and tolerances from observed errors, trajectory by trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from crepes import ConformalRegressor

from slide_fmu.bounds.judge import (
    Judge,
    conformal_factors,
    domain_limits,
    factors_of,
    fit_judge,
    floors_of,
    scales_of,
    shares_of,
    span_factors,
    tolerances_of,
)
from slide_fmu.bounds.observations import Observations, thinned
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.history import History
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.surrogate.error_bound import CONFIDENCES, NO_BOUND, ErrorBound, local_scales
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.samples import CellShape, Shape
from tests.refusals import refused

ALIKE = np.zeros(120, dtype=np.int64)
"""All trajectories of a calibration are of one kind of input."""

SHAPE = Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape())


def bound_of(surrogate: Surrogate) -> ErrorBound:
    assert surrogate.bound is not None
    return surrogate.bound


SHAPE = Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape())
BOUND = bound_of(bounded_surrogate(SHAPE))
USUAL = np.array([0.5, 2.0])


def observations(seed: int, size: float) -> Observations:
    """Random observations; the usual errors are always the same."""
    rng, bound = np.random.default_rng(seed), BOUND
    statistics = size * rng.normal(size=(6, 50, bound.head.n_channels))
    errors = USUAL / 0.95 * rng.uniform(0, 1, (6, 50, 2))
    watched = rng.uniform(0, 1.003, (6, 50, len(bound.limits))) * bound.limits
    disagreement = 4 * USUAL * rng.uniform(0, 1, (6, 50, 2)) ** 5
    return Observations(statistics, watched, disagreement, errors)


def judge_of(calibration: Observations) -> Judge:
    return Judge(
        head=BOUND.head,
        factors=BOUND.factors,
        limits=BOUND.limits,
        span=None,
        floors=0.1 * USUAL,
        shares=np.ones(2),
        quietest=np.zeros(BOUND.n_logarithms),
        calibration=calibration,
        history=History((), (), ()),
    )


def alarms(seen: Observations, tolerances: FloatArray) -> float:
    """The share of samples whose bound is larger, or that are outside of the domain."""
    flat = seen.statistics.reshape(-1, 1, seen.statistics.shape[2])
    bounds = BOUND.factors[1] * local_scales(BOUND.head.evaluate(flat).astype(float))
    bounds = np.maximum(np.hypot(bounds, 0.1 * USUAL), seen.disagreement.reshape(-1, 2))
    outside = (seen.watched > BOUND.limits).any(axis=2).ravel()
    return float(np.mean((bounds > tolerances).any(axis=1) | outside))


def test_tolerances_are_one_multiple_of_the_usual_errors_with_as_many_alarms_as_asked_for() -> (
    None
):
    calibration = observations(3, 1.0)
    quantiles = np.quantile(calibration.errors.reshape(-1, 2), 0.95, axis=0)
    for rate in (0.05, 0.2):
        tolerances = tolerances_of(judge_of(calibration), rate)
        assert rate - 0.01 < alarms(calibration, tolerances) <= rate
        np.testing.assert_allclose(tolerances / quantiles, (tolerances / quantiles)[0])


def repeated(seed: int, size: float) -> Observations:
    """As many trajectories as all confidences need."""
    parts = vars(observations(seed, size)).items()
    return Observations(**{name: np.repeat(values, 20, axis=0) for name, values in parts})


def test_judge_is_calibrated_by_what_its_head_gets() -> None:
    """Its head learns from the first observations and from further ones, of which few count."""
    learnt, calibration, further = repeated(11, 1.0), repeated(12, 5.0), repeated(13, 3.0)
    heard: list[Observations] = []

    def fit(mixes: Sequence[Observations]) -> tuple[FeedForward, History]:
        heard.extend(mixes)
        return BOUND.head, History((), (), ())

    kinds = np.zeros(len(calibration.errors), dtype=np.int64)
    judge = fit_judge([learnt, calibration, further], kinds, 0.01, None, fit)
    assert len(heard) == 2
    assert heard[1].errors.size < 0.07 * learnt.errors.size
    signed = BOUND.head.n_channels - BOUND.n_logarithms
    for mix in (*heard, judge.calibration):
        assert (mix.statistics[:, :, signed:] >= judge.quietest).all()
    assert (calibration.statistics[:, :, signed:] < judge.quietest).any()
    np.testing.assert_array_equal(judge.floors, floors_of(calibration))
    np.testing.assert_array_equal(judge.shares, shares_of(calibration))
    weighed = judge.shares * calibration.disagreement
    np.testing.assert_array_equal(judge.calibration.disagreement, weighed)
    expected = factors_of(BOUND.head, judge.floors, judge.calibration, kinds)
    np.testing.assert_array_equal(judge.factors, expected)
    assert not np.array_equal(expected, factors_of(BOUND.head, judge.floors, calibration, kinds))
    np.testing.assert_array_equal(
        judge.limits, domain_limits(learnt.watched, calibration.watched, 0.01)
    )


def test_estimate_over_a_span_is_scaled_by_what_its_head_gets() -> None:
    head = bound_of(with_span(bounded_surrogate(SHAPE))).head

    def fit(heard: Sequence[Observations]) -> tuple[FeedForward, History]:
        return head, History((), (), ())

    learnt, calibration = repeated(11, 1.0), repeated(12, 1.0)
    block = 2
    judge = fit_judge([learnt, calibration], np.zeros(120, dtype=np.int64), 0.01, block, fit)
    factors = [
        span_factors(calibration.errors, scales_of(head, mix.statistics)[..., 2:], block)
        for mix in (judge.calibration, calibration)
    ]
    assert judge.span is not None
    np.testing.assert_array_equal(judge.span.factors, factors[0])
    assert not np.allclose(*factors)  # quiet statistics count as they do in the FMU


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


def test_few_trajectories_with_large_errors_do_not_raise_the_floors() -> None:
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
