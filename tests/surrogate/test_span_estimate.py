"""The error estimate that is made of a bound, compared with plain loops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.surrogate.span_estimate import SpanEstimate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.samples import random_surrogate
from tests.refusals import refused
from tests.surrogate.plain_trust import SEEING, SHAPE, plain_mean, plain_trust, record


@pytest.mark.parametrize("block", [1, 4])
def test_estimate_of_the_bound_is_that_of_plain_loops(block: int) -> None:
    surrogate = with_span(bounded_surrogate(SHAPE), block)
    bound, inputs = surrogate.bound, record(surrogate)
    assert bound is not None
    assert bound.span is not None
    trust = plain_trust(surrogate, inputs)
    assert trust.rms is not None
    squares = trust.rms**2
    expected = [
        [math.sqrt(plain_mean(squares[:, i].tolist(), k, block)) for i in range(2)]
        for k in range(len(inputs))
    ]
    factors = bound.span.factors * surrogate.output_scaling.scale
    np.testing.assert_allclose(
        surrogate.estimate_error(inputs), factors * np.array(expected), rtol=1e-4
    )
    assert surrogate.estimated_samples == {1: 9, 4: 34}[block]


def test_expected_errors_are_told_where_an_estimate_is_made_of_them() -> None:
    surrogate = bounded_surrogate(SHAPE)
    inputs = record(surrogate)
    plain, found = surrogate.trust(inputs).local, with_span(surrogate).trust(inputs).local
    assert plain.rms is None
    np.testing.assert_array_equal(found.scales, plain.scales)
    assert found.rms is not None
    assert found.rms.shape == found.scales.shape
    assert not np.allclose(found.rms, found.scales)


def test_estimate_needs_an_estimator_or_a_bound() -> None:
    surrogate = bounded_surrogate(SHAPE)
    assert not surrogate.estimates_errors
    with refused(ValueError, "no error estimator", "or by bound.estimate_span"):
        surrogate.estimate_error(record(surrogate))


def test_estimator_of_another_surrogate_is_refused() -> None:
    surrogate = bounded_surrogate(SEEING)
    other = random_surrogate(replace(SEEING, seed=5)).estimator
    with refused(ValueError, "expected its own", "error estimator"):
        replace(surrogate, estimator=other)


def test_estimates_of_bound_and_estimator_at_once_are_refused() -> None:
    surrogate = with_span(bounded_surrogate(SHAPE))
    with refused(ValueError, "error estimator"):
        replace(surrogate, estimator=random_surrogate(SEEING).estimator)
    bound = bounded_surrogate(SEEING).bound
    assert bound is not None
    assert surrogate.bound is not None
    with refused(ValueError, "expected one", "error estimator"):
        replace(bound, span=surrogate.bound.span)


@pytest.mark.parametrize(
    ("block", "factors", "message"),
    [
        (0, [1.0, 1.0], "blocks of 0 samples; expected 1 to"),
        (3, [1.0, 0.0], "expected them finite and positive"),
        (3, [1.0, math.nan], "expected them finite and positive"),
    ],
)
def test_bad_estimate_of_a_bound_is_refused(
    block: int, factors: list[float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        SpanEstimate(block, np.array(factors))


def test_estimate_of_a_head_without_expected_errors_is_refused() -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with refused(ValueError, "values (", "2); expected (", "4)"):
        replace(bound, span=SpanEstimate(3, np.ones(2)))


def test_estimate_for_other_outputs_is_refused() -> None:
    bound = with_span(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    with refused(ValueError, "factors of the estimate", "of shape (3,)"):
        replace(bound, span=SpanEstimate(3, np.ones(3)))
