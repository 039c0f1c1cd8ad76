"""Each call of an FMU has a judge; together they give the tolerances of bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.bounds.calibration import (
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
    return Observations(statistics, statistics, watched, disagreement, errors)


def judge_of(*calibrations: Observations) -> Judge:
    return Judge(
        head=BOUND.head,
        factors=BOUND.factors,
        limits=BOUND.limits,
        span=None,
        floors=0.1 * USUAL,
        shares=np.ones(2),
        quietest=np.zeros(BOUND.n_logarithms),
        calibrations=calibrations,
        history=History((), (), ()),
    )


def alarms(seen: Observations, tolerances: FloatArray) -> float:
    """The share of samples whose bound is larger, or that are outside of the domain."""
    flat = seen.statistics.reshape(-1, 1, seen.statistics.shape[2])
    bounds = BOUND.factors[1] * local_scales(BOUND.head.evaluate(flat).astype(float))
    bounds = np.maximum(np.hypot(bounds, 0.1 * USUAL), seen.disagreement.reshape(-1, 2))
    outside = (seen.watched > BOUND.limits).any(axis=2).ravel()
    return float(np.mean((bounds > tolerances).any(axis=1) | outside))


def test_tolerances_are_one_multiple_of_the_usual_errors_and_the_larger_of_two_calls() -> None:
    plain, known = observations(3, 1.0), observations(4, 3.0)
    alone = tolerances_of(judge_of(plain), 0.2)
    assert 0.19 < alarms(plain, alone) <= 0.2
    both = tolerances_of(judge_of(plain, known), 0.2)
    assert 0.19 < max(alarms(one, both) for one in (plain, known)) <= 0.2
    assert np.all(both >= alone)
    quantiles = np.quantile(plain.errors.reshape(-1, 2), 0.95, axis=0)
    for tolerances in (alone, both):
        np.testing.assert_allclose(tolerances / quantiles, (tolerances / quantiles)[0])


def test_judge_of_two_calls_has_the_larger_factors_and_the_usual_errors_of_the_first() -> None:
    def fit(heard: Sequence[Observations]) -> tuple[FeedForward, History]:
        assert len(heard) == 2
        return BOUND.head, History((), (), ())

    def call(seed: int, size: float) -> list[Observations]:
        parts = [observations(seed + i, size) for i in range(2)]
        return [
            Observations(**{k: np.repeat(v, 20, axis=0) for k, v in vars(p).items()})
            for p in parts
        ]

    kinds = np.zeros(120, dtype=np.int64)
    calls = [call(11, 1.0), call(21, 3.0)]
    both = fit_judge(calls, kinds, 0.01, None, fit)
    expected = np.maximum.reduce(
        [factors_of(BOUND.head, both.floors, mix, kinds) for mix in both.calibrations]
    )
    np.testing.assert_array_equal(both.factors, expected)
    assert not np.array_equal(
        expected, factors_of(BOUND.head, both.floors, both.calibrations[0], kinds)
    )
    np.testing.assert_array_equal(both.floors, floors_of(calls[0][1]))
    np.testing.assert_array_equal(both.shares, shares_of(calls[0][1]))


def test_estimate_over_a_span_is_scaled_by_what_its_head_gets() -> None:
    head = bound_of(with_span(bounded_surrogate(SHAPE))).head

    def fit(heard: Sequence[Observations]) -> tuple[FeedForward, History]:
        return head, History((), (), ())

    learnt, calibration = (
        Observations(
            **{k: np.repeat(v, 20, axis=0) for k, v in vars(observations(s, 1.0)).items()}
        )
        for s in (11, 12)
    )
    block = 2
    judge = fit_judge([[learnt, calibration]], np.zeros(120, dtype=np.int64), 0.01, block, fit)
    factors = [
        span_factors(calibration.errors, scales_of(head, afterwards)[..., 2:], block)
        for afterwards in (judge.calibrations[0].afterwards, calibration.afterwards)
    ]
    assert judge.span is not None
    np.testing.assert_array_equal(judge.span.factors, factors[0])
    assert not np.allclose(*factors)  # quiet statistics count as they do in the FMU
