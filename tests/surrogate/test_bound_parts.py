"""Parts of an error bound that do not fit are refused, and a file keeps those that do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.samples import random_surrogate
from tests.refusals import refused
from tests.surrogate.plain_trust import SEEING, SHAPE, record


@pytest.mark.parametrize("kind", ["alone", "seen", "span"])
def test_file_keeps_the_bound(kind: str) -> None:
    surrogate = bounded_surrogate(SEEING if kind == "seen" else SHAPE)
    surrogate = with_span(surrogate) if kind == "span" else surrogate
    data = surrogate.to_bytes()
    again = Surrogate.from_bytes(data)
    assert again.to_bytes() == data
    inputs = record(surrogate)
    assert np.array_equal(again.trust(inputs).bounds(), surrogate.trust(inputs).bounds())
    assert again.memory_length == surrogate.memory_length
    assert np.array_equal(again.trust(inputs).trusted(), surrogate.trust(inputs).trusted())


def test_bound_without_an_estimate_is_the_same_bound() -> None:
    surrogate = with_span(bounded_surrogate(SHAPE))
    assert surrogate.bound is not None
    alone = replace(surrogate, bound=surrogate.bound.without_estimate())
    assert alone.bound is not None
    assert alone.bound.span is None
    assert not alone.estimates_errors
    inputs = record(surrogate)
    np.testing.assert_allclose(
        alone.trust(inputs).bounds(), surrogate.trust(inputs).bounds(), rtol=1e-5
    )


def test_damaged_file_is_refused() -> None:
    surrogate = bounded_surrogate(SHAPE)
    data = surrogate.to_bytes()
    with refused(PayloadError, "checksum"):
        Surrogate.from_bytes(data[:200] + b"\xff" + data[201:])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"blocks": (3, 2)}, "blocks of 3 and 2 samples"),
        ({"blocks": (0, 2)}, "blocks of 0 and 2 samples"),
        ({"limits": np.zeros(3)}, r"limits .* of shape \(3,\)"),
        ({"factors": np.full((3, 2), -1.0)}, "finite and positive"),
        ({"factors": np.array([[3.0, 1], [2, 1], [1, 1]])}, "expected them to rise"),
    ],
)
def test_parts_that_do_not_fit_are_refused(changes: dict[str, object], message: str) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with pytest.raises(ValueError, match=message):
        replace(bound, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "tolerances", [np.ones(3), np.ones((2, 1)), np.array([1.0, 0.0]), np.array([np.inf, 1.0])]
)
def test_tolerances_of_a_bound_must_be_positive_ones_for_each_output(
    tolerances: FloatArray,
) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with refused(ValueError, "tolerances of an error bound of shape", "expected (2,), finite"):
        replace(bound, tolerances=tolerances)


@pytest.mark.parametrize(
    "floors", [np.ones(3), np.ones((2, 1)), np.array([1.0, -1e-9]), np.array([np.inf, 1.0])]
)
def test_floors_of_a_bound_must_be_finite_ones_for_each_output(floors: FloatArray) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with refused(ValueError, "floors of an error bound", "expected 2 finite numbers"):
        replace(bound, floors=floors)


@pytest.mark.parametrize(
    "shares", [np.ones(3), np.array([1.0, 0.0]), np.array([1.1, 1.0]), np.array([np.nan, 1.0])]
)
def test_shares_of_the_disagreement_are_between_0_and_1(shares: FloatArray) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with refused(ValueError, "shares of the disagreement", "expected 2 numbers above 0"):
        replace(bound, shares=shares)


@pytest.mark.parametrize("doubt", [-1e-9, np.inf, np.nan])
def test_doubt_is_a_finite_factor_that_is_not_negative(doubt: float) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with refused(ValueError, "doubt of an error bound", "expected a finite number"):
        replace(bound, doubt=doubt)


def test_quietest_logarithms_must_be_finite_ones_for_each_logarithm() -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    count = bound.n_logarithms
    for quietest in (np.zeros(count + 1), np.full(count, -np.inf), np.full(count, np.nan)):
        with refused(ValueError, "quietest logarithms", f"expected ({count},), all of them"):
            replace(bound, quietest=quietest)


def test_bound_that_does_not_see_the_estimator_of_its_surrogate_is_refused() -> None:
    seeing, blind = bounded_surrogate(SEEING), bounded_surrogate(SHAPE)
    with refused(ValueError, "uses no error estimator; expected its own: fit the bound again"):
        replace(seeing, bound=blind.bound)
    with refused(ValueError, "uses another error estimator; expected none"):
        replace(blind, bound=seeing.bound)


def test_bound_of_layers_is_refused() -> None:
    bound = bounded_surrogate(SHAPE).bound
    layers = random_surrogate(replace(SHAPE, cell=None))
    with refused(ValueError, "state-space networks without physical parameters"):
        replace(layers, bound=bound)


def test_companion_of_another_window_is_refused() -> None:
    bound = bounded_surrogate(replace(SHAPE, n_in=11)).bound
    with refused(ValueError, "expected"):
        replace(random_surrogate(SHAPE), bound=bound)
