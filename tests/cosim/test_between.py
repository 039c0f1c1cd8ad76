"""Inputs between the times at which they are known."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.cosim.between import even_out, refine

STEP = 0.1


@pytest.mark.parametrize("distance", [1.3, 2.0, 3.5])
def test_long_distances_are_divided_and_smooth_inputs_are_curves(distance: float) -> None:
    times = 5.0 + distance * STEP * np.arange(40)
    frequency = 1.2 / (distance * STEP)
    own, found, places = refine(times, np.sin(frequency * times)[:, None], (), STEP)
    assert np.diff(own).max() <= STEP * (1 + 1e-9)
    assert len(own) == 1 + 39 * np.ceil(distance)
    np.testing.assert_array_equal(own[places], times)
    np.testing.assert_array_equal(found[places, 0], np.sin(frequency * times))
    error = np.abs(found[:, 0] - np.sin(frequency * own))[places[1] : places[-2]]
    by_lines = np.abs(np.interp(own, times, np.sin(frequency * times)) - np.sin(frequency * own))
    assert error.max() < 0.35 * by_lines.max()


def test_short_distances_are_left_as_they_are() -> None:
    times, values = np.array([0.0, 0.1, 0.15, 0.25]), np.arange(8.0).reshape(4, 2)
    own, found, places = refine(times, values, (), STEP)
    assert own is times
    assert found is values
    assert places.tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize("what", ["noise", "steps", "few"])
def test_inputs_that_are_not_smooth_are_straight_lines(what: str) -> None:
    rng = np.random.default_rng(2)
    values = {
        "noise": np.cumsum(rng.normal(size=60)),
        "steps": np.repeat(rng.normal(size=10), 6),
        "few": np.array([0.0, 1.0, 4.0, 9.0]),
    }[what]
    times = 2 * STEP * np.arange(len(values))
    own, found, _ = refine(times, values[:, None], (), STEP)
    np.testing.assert_allclose(found[:, 0], np.interp(own, times, values), atol=1e-12)


def test_each_part_of_a_record_is_taken_for_what_it_is() -> None:
    times = 2 * STEP * np.arange(80)
    values = np.where(np.arange(80) < 40, np.sin(3 * times), 0)
    values[50:] += np.cumsum(np.random.default_rng(2).normal(size=30))
    own, found, _ = refine(times, values[:, None], (), STEP)
    smooth, rough = (own > 1) & (own < 7), own > 11
    assert np.abs(found[smooth, 0] - np.sin(3 * own[smooth])).max() < 5e-3
    np.testing.assert_allclose(found[rough, 0], np.interp(own[rough], times, values), atol=1e-12)


def test_angles_turn_and_their_length_is_a_straight_line() -> None:
    times = 2 * STEP * np.arange(40)

    def director(at: np.ndarray) -> np.ndarray:
        angle, length = 9 * np.sin(1.5 * at), 1 + 0.1 * at
        return np.stack([np.ones_like(at), length * np.cos(angle), length * np.sin(angle)], 1)

    own, found, _ = refine(times, director(times), (1,), STEP)
    inner = slice(2, -2)
    np.testing.assert_allclose(found[inner], director(own)[inner], atol=0.1)
    np.testing.assert_allclose(np.hypot(found[:, 1], found[:, 2]), 1 + 0.1 * own)


@pytest.mark.parametrize("distance", [0.5, 1.0, 0.8])
def test_straight_lines_between_evened_values_have_the_mean_of_the_curve(distance: float) -> None:
    times = np.arange(0.0, 4.0, distance * STEP)
    wave = np.sin(2 * times)
    found = even_out(times, wave[:, None], (), STEP)[:, 0]
    # the mean of straight lines a step long between samples of sin(w t) is that of a smaller sine
    smaller = wave * (1 + (2 * STEP) ** 2 / 12)
    inner = slice(2, -2)
    np.testing.assert_allclose(found[inner], smaller[inner], atol=1e-4)
    assert np.abs(found - wave)[inner].max() > 3e-3


def test_evened_lines_have_the_integral_of_the_curve() -> None:
    times = STEP * np.arange(60)
    found = even_out(times, np.exp(-times)[:, None], (), STEP)[:, 0]
    begin, end = 10, 40
    true = np.exp(-times[begin]) - np.exp(-times[end])
    by_lines = np.trapezoid(np.exp(-times[begin : end + 1]), times[begin : end + 1])
    evened_out = np.trapezoid(found[begin : end + 1], times[begin : end + 1])
    assert abs(evened_out - true) < 0.02 * abs(by_lines - true)


@pytest.mark.parametrize("what", ["noise", "steps", "few"])
def test_values_that_are_not_smooth_are_not_evened(what: str) -> None:
    rng = np.random.default_rng(2)
    values = {
        "noise": np.cumsum(rng.normal(size=60)),
        "steps": np.repeat(rng.normal(size=10), 6),
        "few": np.array([0.0, 1.0]),
    }[what]
    times = STEP * np.arange(len(values))
    found = even_out(times, values[:, None], (), STEP)[:, 0]
    np.testing.assert_allclose(found, values, atol=1e-12)


def test_of_an_angle_the_turn_is_evened() -> None:
    times = STEP * np.arange(40)
    angle = np.sin(3 * times)
    director = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found = even_out(times, director, (0,), STEP)
    turned = np.arctan2(found[:, 1], found[:, 0])
    np.testing.assert_allclose(np.hypot(*found.T), 1.0, atol=1e-12)
    np.testing.assert_allclose(turned, even_out(times, angle[:, None], (), STEP)[:, 0], atol=1e-12)
