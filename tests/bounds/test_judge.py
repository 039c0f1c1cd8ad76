"""Each call of an FMU has a judge; together they give the tolerances of bounds."""

from __future__ import annotations

import numpy as np

from slide_fmu.bounds.judge import Judge, tolerances_of
from slide_fmu.bounds.observations import Observations
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.history import History
from slide_fmu.surrogate.error_bound import local_scales
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape

SHAPE = Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape())
USUAL = np.array([0.5, 2.0])


def judge_of(seed: int, size: float) -> Judge:
    """A judge with a random head and random observations, whose usual errors are the same."""
    rng, bound = np.random.default_rng(seed), bounded_surrogate(SHAPE).bound
    assert bound is not None
    statistics = size * rng.normal(size=(6, 50, bound.head.n_channels))
    errors = USUAL / 0.95 * rng.uniform(0, 1, (6, 50, 2))
    watched = rng.uniform(0, 1.003, (6, 50, len(bound.limits))) * bound.limits
    disagreement = 4 * USUAL * rng.uniform(0, 1, (6, 50, 2)) ** 5
    seen = Observations(statistics, statistics, watched, disagreement, errors)
    return Judge(
        head=bound.head,
        factors=bound.factors,
        limits=bound.limits,
        span=None,
        floors=0.1 * USUAL,
        shares=np.ones(2),
        quietest=np.zeros(bound.n_logarithms),
        calibration=seen,
        history=History((), (), ()),
    )


def alarms(judge: Judge, tolerances: FloatArray) -> float:
    """The share of samples whose bound is larger, or that are outside of the domain."""
    seen = judge.calibration
    flat = seen.statistics.reshape(-1, 1, seen.statistics.shape[2])
    bounds = judge.factors[1] * local_scales(judge.head.evaluate(flat).astype(float))
    bounds = np.maximum(np.hypot(bounds, judge.floors), seen.disagreement.reshape(-1, 2))
    outside = (seen.watched > judge.limits).any(axis=2).ravel()
    return float(np.mean((bounds > tolerances).any(axis=1) | outside))


def test_tolerances_are_one_multiple_of_the_usual_errors_and_the_larger_of_two_calls() -> None:
    plain, known = judge_of(3, 1.0), judge_of(4, 3.0)
    alone = tolerances_of([plain], 0.2)
    assert 0.19 < alarms(plain, alone) <= 0.2
    both = tolerances_of([plain, known], 0.2)
    assert 0.19 < max(alarms(one, both) for one in (plain, known)) <= 0.2
    assert both.tolist() >= alone.tolist()
    quantiles = np.quantile(plain.calibration.errors.reshape(-1, 2), 0.95, axis=0)
    for tolerances in (alone, both):
        np.testing.assert_allclose(tolerances / quantiles, (tolerances / quantiles)[0])
