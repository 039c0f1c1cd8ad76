"""Moves from rest to rest cover their distance, have the peaks that they tell, and keep limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.excitation.speed_profile import SpeedProfiles, fastest_phases

FINE = 20001

phases = st.floats(0.1, 0.5)


def profiles(speeding: float, slowing: float, rounded: float) -> SpeedProfiles:
    return SpeedProfiles(np.array([speeding]), np.array([slowing]), np.array([rounded]))


@given(ramp=st.floats(0.01, 0.5))
def test_trapezoid_goes_the_whole_way_and_is_symmetric(ramp: float) -> None:
    phase = np.linspace(0, 1, 101)
    way = SpeedProfiles.sharp(np.full(101, ramp)).way(phase)
    assert (way[0], way[50], way[-1]) == pytest.approx((0, 0.5, 1), abs=1e-15)
    assert way + way[::-1] == pytest.approx(np.ones(101), abs=1e-12)
    assert np.all(np.diff(way) > 0)


@given(speeding=phases, slowing=phases, rounded=st.floats(0.05, 1.0))
def test_profile_has_the_peaks_that_it_tells(
    speeding: float, slowing: float, rounded: float
) -> None:
    one = profiles(speeding, slowing, rounded)
    done = np.linspace(0, 1, FINE)
    way = one.way(done[None])[0]
    assert abs(way[0]) < 1e-12
    assert abs(way[-1] - 1) < 1e-9
    step = done[1]
    for order, inverse in enumerate(one.inverse_peaks(), start=1):
        way = np.diff(way) / step
        # differences of third order are those of rounding too: 1e-16 / step^3
        assert np.abs(way).max() == pytest.approx(1 / inverse[0], rel=2e-3 if order < 3 else 0.05)


def test_profile_rests_before_and_after_its_time() -> None:
    way = profiles(0.3, 0.2, 0.5).way(np.array([[0.0, 1.0, 1.7]]))
    np.testing.assert_allclose(way, [[0.0, 1.0, 1.0]], atol=1e-12)


def test_twice_the_way_takes_longer_and_no_limit_no_time() -> None:
    one, way = profiles(0.3, 0.3, 0.5), np.array([1.0, 0.5])
    limits = [np.full(2, 1.0), np.full(2, 4.0)]
    once, twice = (one.least_times(f * way, limits)[0] for f in (1.0, 2.0))
    assert once < twice <= 2 * once
    assert one.least_times(way, [np.full(2, np.inf)] * 3)[0] == 0


def test_sharp_corners_keep_no_limit_of_the_jerk() -> None:
    jerk = [np.array([np.inf])] * 2 + [np.array([3.0])]
    assert SpeedProfiles.sharp(np.array([0.3])).least_times(np.ones(1), jerk)[0] == np.inf


@pytest.mark.parametrize(
    ("way", "speed", "fastest"),
    [(2.0, 0.0, 1.0), (0.1, 0.0, 1.0), (-3.0, 0.8, 1.0), (0.01, 0.9, 1.0), (1.5, 0.9, 0.5)],
    ids=["cruise", "jog", "turns back", "beyond and back", "too fast at first"],
)
def test_the_fastest_move_reaches_its_target_at_rest(
    way: float, speed: float, fastest: float
) -> None:
    place, now, whole = 0.0, speed, 0.0
    for lasts, acceleration in fastest_phases(way, speed, fastest, 2.0):
        assert lasts >= 0
        place += lasts * (now + 0.5 * acceleration * lasts)
        now += acceleration * lasts
        whole += lasts
        assert abs(now) <= max(fastest, abs(speed)) + 1e-12
    assert place == pytest.approx(way, abs=1e-12)
    assert now == pytest.approx(0.0, abs=1e-12)
    if speed == 0.0:  # a trapezoid of speed, or a triangle where the limit is not reached
        ramp = fastest / 2.0
        least = abs(way) / fastest + ramp if abs(way) > fastest * ramp else 2 * np.sqrt(way / 2.0)
        assert whole == pytest.approx(least)
