"""A judge takes head, factors, limits and tolerances from observed errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.bounds.calibration import (
    domain_limits,
    factors_of,
    floors_of,
    scales_of,
    shares_of,
    span_factors,
)
from slide_fmu.bounds.judge import Judge, fit_judge, tolerances_of
from slide_fmu.bounds.observations import Observations
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.history import History
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.surrogate.error_bound import ErrorBound, local_scales
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.samples import CellShape, Shape


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
