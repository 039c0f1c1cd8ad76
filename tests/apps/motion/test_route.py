"""Moves pass points on their route: near enough, within all limits, without resting there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import slide_fmu as slide
from slide_fmu.apps.motion import (
    Limits,
    MotionError,
    MoveFamily,
    MoveProblem,
    ViaPoints,
    choose,
    coordinates_of,
    earliest,
    largest,
    quietest,
    read_task,
    settled,
)
from slide_fmu.apps.motion.move import Move
from slide_fmu.apps.motion.route import Route, fastest, fastest_along, least_steps
from slide_fmu.apps.motion.task import MoveTask, limits_of
from slide_fmu.core.signals import FloatArray
from tests.refusals import refused

ROOT = Path(__file__).parents[3]


def robot_problem() -> MoveProblem:
    surrogate = slide.load(ROOT / "fmus" / "robot_6r" / "robot_6r.fmu")
    task = read_task(ROOT / "docs" / "tutorials" / "past_a_point.toml")
    assert isinstance(task, MoveTask)
    joints = coordinates_of(surrogate.inputs)
    limits = limits_of(task.limits, joints)
    return MoveProblem(
        surrogate, *task.points(joints), limits, task.tolerance, task.via_points(joints)
    )


def duffing_problem(*via: float, near: float = 60.0) -> MoveProblem:
    """A force that may change by 4000 N/s, and whose outputs are those of held samples."""
    surrogate = slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu")
    one = np.ones(1)
    limits = Limits(-1000 * one, 1000 * one, 4000 * one, np.inf * one, np.inf * one)
    via = ViaPoints(np.array(via)[:, None], near * one)
    return MoveProblem(surrogate, 0 * one, 600 * one, limits, 5e-3, via)


def nearest(motion: FloatArray, point: FloatArray, near: FloatArray, parts: int) -> float:
    """The distance of lines between samples from a point, in tolerances, by brute force."""
    share = np.linspace(0, 1, parts, endpoint=False)[:, None, None]
    rows = motion[:-1] + share * (motion[1:] - motion[:-1])
    return float((np.abs(rows - point) / near).max(axis=-1).min())


def require_passed(problem: MoveProblem, move: Move, parts: int = 50) -> None:
    assert problem.via is not None
    step = problem.surrogate.window.step
    assert problem.limits.kept(problem.start, move.motion, step)
    for point in problem.via.points:
        assert nearest(move.motion, point, problem.via.near, parts) <= 1
    np.testing.assert_allclose(move.motion[move.end :] - problem.goal, 0, atol=1e-12)


@pytest.mark.extended
def test_earliest_move_of_the_robot_passes_the_point_and_settles_before_any_shaper() -> None:
    problem = robot_problem()
    found = earliest(problem)
    for move in (found.move, *found.baselines):
        require_passed(problem, move)
    assert found.move.name == "optimised"
    mine, *others = (
        move.trusted(settled, found.response, problem.tolerance)
        for move in (found.move, *found.baselines)
    )
    assert mine < min(others)
    # straight, it would miss the point by far; it does not rest there either
    straight = earliest(replace(problem, via=None)).move
    assert problem.via is not None
    point, near = problem.via.points[0], problem.via.near
    # several joint motions are equally early: rounding decides by how much it misses
    assert nearest(straight.motion, point, near, 50) > 2
    closest = int(np.argmin(np.abs(found.move.motion - point).max(axis=1)))
    speed = np.abs(np.diff(found.move.motion, axis=0))[closest - 2 : closest + 2].max()
    assert speed / problem.surrogate.window.step > 0.5


@pytest.mark.parametrize("moving", [False, True])
def test_a_point_near_the_start_is_passed_at_the_start(moving: bool) -> None:
    one = np.ones(1)
    route = Route(np.array([[0.0], [1.0], [600.0]]), 2 * one, 600 * one)
    assert route.missed(np.array([[200.0], [400.0], [600.0]]), moving) <= 0.5


def test_a_point_between_the_start_and_the_first_sample_is_passed_by_inputs_that_move() -> None:
    route = Route(np.array([[0.0], [100.0], [600.0]]), np.ones(1), 600 * np.ones(1))
    motion = np.array([[200.0], [400.0], [600.0]])
    assert route.missed(motion, moving=True) == 0
    assert route.missed(motion, moving=False) == 100


def test_quietest_move_passes_two_points_in_their_order() -> None:
    problem = duffing_problem(-200.0, 300.0)
    found = quietest(problem, 0.75)
    require_passed(problem, found.move, parts=1)
    force = found.move.motion[:, 0]
    assert np.argmin(np.abs(force + 200)) < np.argmin(np.abs(force - 300))
    left = [np.abs(move.outputs[move.end :]).max() for move in (found.move, *found.baselines)]
    assert left[0] == min(left)


def test_a_wider_tolerance_bends_the_way_less_and_saves_time() -> None:
    points = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    free, one = np.full(2, np.inf), np.ones(2)
    limits = Limits(-9 * one, 9 * one, one, 4 * one, free)
    times = []
    for near in (1e-3, 0.3):
        route = Route(points, near * one, one)
        times.append(fastest_along(route, limits)[1])
        share = np.linspace(0, 1, 2001)
        assert np.min(np.abs(route.at(share) - points[1]).max(axis=1)) <= near
        np.testing.assert_allclose(route.at(np.array([0.0, 1.0])), points[[0, 2]], atol=1e-12)
        slopes = np.gradient(route.at(share), share, axis=0)
        np.testing.assert_allclose(route.slopes(share)[2:-2], slopes[2:-2], atol=1e-3)
    assert times[1] < 0.95 * times[0]


def test_fastest_profile_along_a_curve_keeps_its_limits_and_uses_one() -> None:
    points = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    one, step = np.ones(2), 1e-3
    limits = Limits(-9 * one, 9 * one, one, 4 * one, 60 * one)
    route = Route(points, 0.1 * one, one)
    profile, time = fastest_along(route, limits)
    done = step * np.arange(1, int(np.ceil(time / step)) + 2) / time
    used = limits.used(points[0], route.at(profile.way(done[None])[0]), step)
    assert max(used.values()) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("problem", "message"),
    [
        (lambda: duffing_problem(0.0), r"start and via 1 are both \[0\.0\]; expected two points"),
        (
            lambda: duffing_problem(990.0, -990.0, 990.0, near=1.0),
            r"leaves the range of force by .*: move",
        ),
    ],
)
def test_ways_that_cannot_be_are_refused(problem: object, message: str) -> None:
    with pytest.raises(MotionError, match=message):
        problem()  # type: ignore[operator]


def test_candidates_that_should_pass_points_are_refused() -> None:
    with refused(MotionError, "expected no points", "remove via"):
        choose(duffing_problem(300.0), largest, MoveFamily(10, 1.5, 0))


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
