"""Squared errors from what the estimator's network gives, and estimators that do not fit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.scaling import LogError
from slide_fmu.core.window import MAX_WINDOW
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.surrogate import error_estimator
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from tests.refusals import refused

RANGES = np.array([[-1.0, -2.0], [0.5, 3.0]], np.float32)
INSIDE = np.zeros((1, 2), np.float32)
MAP = LogError(-3, 1)
"""eps = -1 is an error of 0.001, eps = 0 of 0.1, eps = 1 of 10: the largest."""


def network_of(n_values: int, n_samples: int = 3) -> FeedForward:
    """A network that gives as many values, all zero, of two inputs."""
    columns = 2 * n_samples
    zeros = Layer(np.zeros((n_values, columns), np.float32), np.zeros(n_values, np.float32),
                  "identity")  # fmt: skip
    return FeedForward((zeros,), n_samples, FeatureMap(Differences(2)))


def estimator_of(n_values: int = 2, positions: int = 4) -> ErrorEstimator:
    return ErrorEstimator(network_of(n_values), MAP, positions, RANGES)


def test_memory_length_counts_the_samples_of_all_positions() -> None:
    assert estimator_of(positions=1).memory_length == 3
    assert estimator_of(positions=4).memory_length == 6


def test_ends_of_the_range_are_known_and_what_lies_beyond_is_not() -> None:
    step = np.float32(1e-6)
    rows = [RANGES[0], RANGES[1], RANGES[0] - [0, step], RANGES[1] + [step, 0], [np.nan, 0.0]]
    found = estimator_of().knows(np.array(rows, np.float32))
    assert found.tolist() == [True, True, False, False, False]


def test_exponents_alone_give_the_error_of_the_map() -> None:
    values = np.array([[-1.0, 0.0], [0.5, 1.0]])
    found = estimator_of().squares(values, np.repeat(INSIDE, 2, axis=0), 2)
    assert found == pytest.approx(np.array([[1e-6, 1e-2], [1.0, 100.0]]))


def test_expected_error_adds_to_the_standard_deviation_around_it() -> None:
    """First mu of both outputs, then eps of both: e^2 (1 + mu^2)."""
    values = np.array([[2.0, -3.0, -1.0, 0.0]])
    found = estimator_of(4).squares(values, INSIDE, 2)
    assert found == pytest.approx(np.array([[5e-6, 10e-2]]))


def test_no_error_is_larger_than_the_map_knows() -> None:
    """Neither by its exponent nor by its expected error."""
    assert estimator_of().squares(np.array([[7.0, 0.9]]), INSIDE, 2) == pytest.approx(
        np.array([[100.0, 10**1.6]])
    )
    huge = estimator_of().squares(np.array([[1e9, -1e9]]), INSIDE, 2)  # with no overflow
    assert huge == pytest.approx(np.array([[100.0, 0.0]]))
    found = estimator_of(4).squares(np.array([[0.0, 1e9, 1.0, 0.9]]), INSIDE, 2)
    assert found == pytest.approx(np.array([[100.0, 100.0]]))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(4))
def test_value_that_is_not_finite_counts_as_the_largest_error_of_its_output_alone(
    bad: float, place: int
) -> None:
    values = np.array([[0.0, 0.0, 0.0, 0.0]])
    values[0, place] = bad
    with np.errstate(invalid="ignore"):
        found = estimator_of(4).squares(values, INSIDE, 2)
    expected = [0.01, 0.01]
    expected[place % 2] = 100.0
    assert found == pytest.approx(np.array([expected]))


def test_unknown_features_count_as_the_largest_error_of_all_outputs() -> None:
    newest = np.array([[0.0, 0.0], [0.6, 0.0]], np.float32)
    found = estimator_of().squares(np.zeros((2, 2)), newest, 2)
    assert found == pytest.approx(np.array([[0.01, 0.01], [100.0, 100.0]]))


def test_record_has_an_error_for_each_of_its_samples() -> None:
    scaled = np.array([[0.0, 0.0], [0.6, 0.0], [0.5, 3.0]])
    found = estimator_of().along(scaled, 2)
    assert found == pytest.approx(np.array([[0.01] * 2, [100.0] * 2, [0.01] * 2]))


@pytest.mark.parametrize("n_values", [2, 4])
def test_one_or_two_values_for_each_output_fit(n_values: int) -> None:
    estimator_of(n_values).require_outputs(2)


@pytest.mark.parametrize("n_values", [1, 3, 5])
def test_other_numbers_of_values_are_refused(n_values: int) -> None:
    with pytest.raises(ValueError, match=f"gives {n_values} values; expected 2 or 4"):
        estimator_of(n_values).require_outputs(2)


@pytest.mark.parametrize(("positions", "fits"), [(0, 0), (1, 1), (MAX_WINDOW, 1),
                                                 (MAX_WINDOW + 1, 0)])  # fmt: skip
def test_positions_are_one_to_the_largest_window(positions: int, fits: int) -> None:
    estimator = estimator_of(positions=positions)
    if fits:
        estimator.require_outputs(2)
    else:
        with pytest.raises(ValueError, match=f"3 samples at {positions} positions; expected 1 to"):
            estimator.require_outputs(2)


@pytest.mark.parametrize(("limit", "fits"), [(2, False), (3, True)])
def test_samples_of_the_network_are_at_most_the_largest_window(
    limit: int, fits: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The network sees three samples; the largest window is made small for the test."""
    monkeypatch.setattr(error_estimator, "MAX_WINDOW", limit)
    estimator = estimator_of(positions=1)
    if fits:
        estimator.require_outputs(2)
    else:
        with refused(ValueError, "expected 1 to", "3 samples at"):
            estimator.require_outputs(2)


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        (RANGES[:1], r"ranges of shape \(1, 2\); expected least and largest value of 2 features"),
        (RANGES[:, :1], r"ranges of shape \(2, 1\)"),
        (RANGES[::-1], r"feature 0 lies in 0\.5 \.\. -1; expected finite numbers, the smaller"),
        (np.array([[0, -np.inf], [0, 1]], np.float32), r"feature 1 lies in -inf \.\. 1"),
        (np.array([[0, 0], [0, np.inf]], np.float32), r"feature 1 lies in 0 \.\. inf"),
        (np.array([[0, np.nan], [0, 1]], np.float32), r"feature 1 lies in nan \.\. 1"),
    ],
)
def test_ranges_that_are_none_are_refused(ranges: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(estimator_of(), ranges=ranges).require_outputs(2)


def test_range_of_a_single_value_is_accepted() -> None:
    replace(estimator_of(), ranges=np.zeros((2, 2), np.float32)).require_outputs(2)
