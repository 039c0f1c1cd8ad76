"""The error bound along records: its size, its confidence and its domain."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.surrogate.error_bound import (
    CONFIDENCES,
    MOST_EXPONENT,
    ErrorBound,
    LocalErrors,
    calibrated,
    least_trajectories,
)
from tests.bounded import bounded_surrogate
from tests.fmu.samples import random_surrogate
from tests.refusals import refused
from tests.surrogate.plain_trust import SHAPE, record


def test_bounds_have_floors_and_are_at_least_a_share_of_the_disagreement() -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    apart = np.array([[9.0, 0.0], [0.0, 9.0], [np.inf, 0.0]])
    local = LocalErrors(np.full((3, 2), 0.5), apart, np.ones(3))
    one, other = np.hypot(0.5 * bound.factors[1], bound.floors)
    expected = [[9.0, other], [one, 0.5 * 9.0], [2.0**MOST_EXPONENT, other]]
    np.testing.assert_allclose(bound.bounds(local, 0.95), expected, rtol=1e-14)


@pytest.mark.parametrize(("confidence", "least"), [(0.9, 10), (0.95, 20), (0.99, 100)])
def test_confidence_is_calibrated_from_its_least_number_of_trajectories_on(
    confidence: float, least: int
) -> None:
    assert least_trajectories(confidence) == least
    assert confidence in calibrated(least)
    assert confidence not in calibrated(least - 1)


@pytest.mark.parametrize(("confidence", "row"), [(0.9, 0), (0.93, 1), (0.95, 1), (0.99, 2)])
def test_confidence_takes_the_next_calibrated_one(confidence: float, row: int) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    assert np.array_equal(bound.factors_at(confidence), bound.factors[row])


@pytest.mark.parametrize("confidence", [0.5, 0.995, math.nan])
def test_confidence_that_is_not_calibrated_is_refused(confidence: float) -> None:
    surrogate = bounded_surrogate(SHAPE)
    with refused(ValueError, "confidence", "expected 0.9 to 0.99"):
        surrogate.trust(record(surrogate)).bounds(confidence)


def test_domain_needs_inputs_in_their_ranges_too() -> None:
    surrogate = bounded_surrogate(SHAPE)
    bound = surrogate.bound
    assert bound is not None
    wide = replace(bound, limits=np.full(bound.limits.shape, 1e9))
    surrogate = replace(surrogate, bound=wide)
    inputs = record(surrogate)
    scaled = (
        0.9
        * surrogate.input_scaling.apply(inputs)
        / np.abs(surrogate.input_scaling.apply(inputs)).max()
    )
    inside = surrogate.input_scaling.invert(scaled)
    assert surrogate.trust(inside).in_domain.all()
    inside[30] = surrogate.input_scaling.invert(np.array([1.5, 0.0]))
    assert not surrogate.trust(inside).in_domain[30]


def test_trust_with_bad_tolerances_is_refused() -> None:
    surrogate = bounded_surrogate(SHAPE)
    inputs = record(surrogate)
    for bad in (np.ones(3), np.array([1.0, -1.0]), np.array([1.0, np.nan])):
        with refused(ValueError, "expected 2 finite numbers that are not negative"):
            surrogate.trust(inputs).trusted(bad)


def test_surrogate_without_a_bound_says_so() -> None:
    surrogate = random_surrogate(SHAPE)
    with refused(ValueError, "recipe's table"):
        surrogate.trust(record(surrogate)).bounds()


def test_confidences_rise() -> None:
    assert list(CONFIDENCES) == sorted(set(CONFIDENCES))
    assert isinstance(bounded_surrogate(SHAPE).bound, ErrorBound)


def test_bounds_and_domain_of_many_records_are_those_of_each() -> None:
    surrogate = bounded_surrogate(SHAPE)
    one = record(surrogate)
    records = np.stack([one, 1.7 * one, one[::-1]])
    trusts = surrogate.trust_batch(records)
    assert len(trusts) == 3
    for inputs, trust in zip(records, trusts, strict=True):
        alone = surrogate.trust(inputs)
        np.testing.assert_allclose(trust.bounds(), alone.bounds(), rtol=1e-5)
        assert np.array_equal(trust.in_domain, alone.in_domain)
    assert not np.allclose(trusts[0].bounds(), trusts[2].bounds())
