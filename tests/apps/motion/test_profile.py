"""The fastest profiles use limits and break none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.route import fastest, least_steps
from slide_fmu.core.signals import FloatArray


def limits(speed: object, acceleration: object, jerk: object = np.inf, count: int = 2) -> Limits:
    ends = np.full(count, 10.0)
    every = (np.broadcast_to(np.asarray(v, float), count) for v in (speed, acceleration, jerk))
    return Limits(-ends, ends, *every)


@pytest.mark.parametrize("jerk", [np.inf, 60.0])
def test_fastest_profile_uses_a_limit_and_breaks_none(jerk: float) -> None:
    way, bounds = np.array([1.5, -0.4]), limits([1.4, 3.0], [5.0, 2.0], jerk)
    profile, time = fastest(way, bounds)
    step = 1e-3
    count = int(np.ceil(time / step)) + 5
    motion = profile.way(step * np.arange(1, count)[None] / time)[0][:, None] * way
    used = bounds.used(np.zeros(2), motion, step)
    assert bounds.kept(np.zeros(2), motion, step)
    assert max(part for name, part in used.items() if name != "range") > 0.97


def test_fastest_trapezoid_takes_the_time_of_the_textbook() -> None:
    """A way w with speed v and acceleration a takes w / v + v / a, or 2 (w / a)^0.5."""
    one = np.array([1.0])
    _, long = fastest(2.0 * one, limits(1.0, 4.0, count=1))
    assert long == pytest.approx(2.0 + 0.25, rel=0.02)
    _, short = fastest(0.1 * one, limits(10.0, 4.0, count=1))
    assert short == pytest.approx(2 * np.sqrt(0.1 / 4.0), rel=0.02)


def test_limits_name_what_a_motion_uses_of_each() -> None:
    bounds, step = limits(2.0, 8.0, 100.0, count=1), 0.1
    motion: FloatArray = np.array([[0.1], [0.2], [0.3]])
    used = bounds.used(np.zeros(1), motion, step)
    assert used["speed"] == pytest.approx(0.5)  # 1 per s of 2
    assert used["acceleration"] == pytest.approx(1.25)  # from 0 to 1 per s within a step
    assert used["range"] == pytest.approx(0.03)
    assert not bounds.kept(np.zeros(1), motion, step)
    angle = Limits(np.array([-np.inf]), np.array([np.inf]), *(np.array([1e3]),) * 3)
    assert set(angle.used(np.zeros(1), motion, step)) == {"speed", "acceleration", "jerk"}
    free = Limits(np.array([-np.inf]), np.array([np.inf]), *(np.array([np.inf]),) * 3)
    assert free.used(np.zeros(1), motion, step) == {}
    assert free.kept(np.zeros(1), motion, step)


@given(way=st.floats(0.01, 3.0), speed=st.floats(0.5, 4.0), acceleration=st.floats(2.0, 20.0))
def test_least_steps_are_those_of_samples_that_speed_up_and_slow_down_fully(
    way: float, speed: float, acceleration: float
) -> None:
    step = 0.02
    steps = least_steps(np.array([way, 0.0]), limits(speed, acceleration), step)

    def reach(count: int) -> float:
        """The largest distance in a number of steps, by speeds that rise as far as they can."""
        speeds = [0.0] * (count + 2)
        for at in range(1, count + 1):
            speeds[at] = min(speeds[at - 1] + step * acceleration, speed)
        for at in range(count, 0, -1):
            speeds[at] = min(speeds[at], speeds[at + 1] + step * acceleration)
        return step * sum(speeds)

    assert reach(steps) >= way * (1 - 1e-6)
    assert steps == 1 or reach(steps - 1) <= way * (1 + 1e-6)
