"""Motions of a robot's joints as users command them: jogs, pick and place, weaving, stops.

Moderate ones keep speeds of 1.4 to 4.2 rad/s and four times as much per s^2, the limits that the
recipe of the robot names. Harsh ones keep twice the speeds and three times the accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from kind_tables import MODERATE, Machine
from motion_profiles import (
    Segments,
    along,
    cut,
    end_of,
    filled,
    length_of,
    smoothed,
    to_speed,
)
from numpy.random import Generator

from mbs_models.robot_6r.puma_560 import JOINTS, LIMITS
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.speed_profile import fastest_phases
from slide_fmu.systems.base import RandomStates, State, System

DEGREE = math.pi / 180.0
SPEEDS = np.array([1.431, 1.292, 2.129, 3.979, 4.206, 3.979])
"""Moderate speeds in rad/s, as in the recipe of the robot."""
ACCELERATIONS = np.array([5.7, 5.2, 8.5, 15.9, 16.8, 15.9])
"""Moderate accelerations in rad/s^2, as in the recipe of the robot."""
HARSH_SPEED, HARSH_ACCELERATION = 2.0, 3.0
"""Harsh motions have these times the moderate speeds and accelerations."""
REACH = 0.95
"""Motions keep this part of the joints' ranges."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of the joints: speeds in rad/s and accelerations in rad/s^2, (6,) each."""

    speeds: FloatArray
    accelerations: FloatArray

    def part(self, speed: float, acceleration: float) -> Limits:
        """Return parts of both."""
        return Limits(speed * self.speeds, acceleration * self.accelerations)


def limits_of(harsh: bool) -> Limits:
    """Return the limits of moderate or harsh motions."""
    moderate = Limits(SPEEDS, ACCELERATIONS)
    return moderate.part(HARSH_SPEED, HARSH_ACCELERATION) if harsh else moderate


def _pose(rng: Generator, reach: float = REACH) -> FloatArray:
    return rng.uniform(-reach, reach, JOINTS) * LIMITS


def _through(
    times: FloatArray,
    poses: FloatArray,
    dwells: FloatArray,
    limits: Limits,
    span: float = 0.0,
) -> FloatArray:
    """Return motions from pose to pose, (n, 6), all joints in step, the slowest at its limit.

    Args:
        dwells: times in s at the poses, (n,).
        span: time in s over which the acceleration rises.
    """
    segments: Segments = [(float(dwells[0]), 0.0)]
    for before, after, dwell in zip(poses[:-1], poses[1:], dwells[1:], strict=True):
        way = np.maximum(np.abs(after - before), 1e-9)
        speed, acceleration = np.min(limits.speeds / way), np.min(limits.accelerations / way)
        segments += [
            *fastest_phases(1.0, 0.0, float(speed), float(acceleration)),
            (float(dwell), 0.0),
        ]

    def places(at: FloatArray) -> FloatArray:
        done = along(at, segments)
        numbers = np.arange(len(poses))
        return np.column_stack([np.interp(done, numbers, joint) for joint in poses.T])

    return smoothed(places, times, span) if span else places(times)


def _many(times: FloatArray, least: float) -> int:
    """Return the number of poses of a motion whose parts last at least a time in s."""
    return math.ceil(times[-1] / least) + 2


def _each(draw: Callable[[int], tuple[float, Segments]], times: FloatArray) -> FloatArray:
    """Return joints that move on their own, each from its start along its segments."""
    found = [draw(joint) for joint in range(JOINTS)]
    return np.column_stack([start + along(times, segments) for start, segments in found])


def _own_moves(
    rng: Generator,
    times: FloatArray,
    limits: Limits,
    dwells: tuple[float, float],
    longest: FloatArray,
) -> FloatArray:
    """Return joints that make minimum-time moves of their own, up to the longest ones, (6,)."""

    def draw(joint: int) -> tuple[float, Segments]:
        most = float(REACH * LIMITS[joint])
        begin = place = float(rng.uniform(-most, most))

        def move() -> Segments:
            nonlocal place
            way = float(rng.uniform(0.1, 1.0) * longest[joint] * rng.choice([-1.0, 1.0]))
            goal = float(np.clip(place + way, -most, most))
            speed, change = limits.speeds[joint], limits.accelerations[joint]
            there = fastest_phases(goal - place, 0.0, float(speed), float(change))
            place = goal
            return [(float(rng.uniform(*dwells)), 0.0), *there]

        return begin, filled(float(times[-1]), move)

    return _each(draw, times)


def minimum_time_on_their_own(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return minimum-time moves of all joints, which start and stop on their own."""
    return _own_moves(rng, times, limits_of(harsh), (0.0, 0.8), 1.2 * LIMITS)


def bang_bang(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return joints that always accelerate at their limits, each on its own."""
    limits = limits_of(harsh)
    longest = limits.speeds**2 / limits.accelerations  # there the speed just reaches its limit
    return _own_moves(rng, times, limits, (0.0, 0.0), longest)


def minimum_time_moves(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves that all joints begin together, and each ends as soon as it can."""
    limits, places = limits_of(harsh), _pose(rng)
    begin, joined = places.copy(), [[] for _ in range(JOINTS)]  # type: list[Segments]
    lasting = 0.0
    while lasting < times[-1]:
        goal = _pose(rng)
        moves = [
            fastest_phases(float(way), 0.0, float(speed), float(change))
            for way, speed, change in zip(
                goal - places, limits.speeds, limits.accelerations, strict=True
            )
        ]
        cycle = max(length_of(move) for move in moves) + float(rng.uniform(0.1, 0.8))
        for joint, move in zip(joined, moves, strict=True):
            joint += [*move, (cycle - length_of(move), 0.0)]
        places, lasting = goal, lasting + cycle
    return _each(lambda joint: (float(begin[joint]), joined[joint]), times)


def reversal_in_mid_move(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return joints that get other goals on their way, each on its own, and brake at once."""
    limits = limits_of(harsh)

    def draw(joint: int) -> tuple[float, Segments]:
        most = float(REACH * LIMITS[joint])
        begin = place = float(rng.uniform(-most, most))
        top, change, speed = float(limits.speeds[joint]), float(limits.accelerations[joint]), 0.0

        def part() -> Segments:
            nonlocal place, speed
            there = fastest_phases(float(rng.uniform(-most, most)) - place, speed, top, change)
            if rng.uniform() < 0.7:
                there = cut(there, float(rng.uniform(0.2, 0.9)) * length_of(there))
            way, speed = end_of(there, speed)
            place += way
            return there

        return begin, filled(float(times[-1]), part)

    return _each(draw, times)


def s_curve_moves(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves of all joints in step, with limited jerk."""
    count = _many(times, 0.2)
    poses = np.array([_pose(rng) for _ in range(count)])
    span = float(rng.uniform(0.04, 0.2))
    return _through(times, poses, rng.uniform(0.1, 0.8, count), limits_of(harsh), span)


def whole_range_moves(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves from one end of the ranges to the other, of some joints or all."""
    count = _many(times, 0.3)
    sides = np.where(rng.uniform(size=(count, JOINTS)) < 0.8, 1.0, rng.uniform(-1.0, 1.0, JOINTS))
    sides[1::2] *= -1.0
    poses = REACH * LIMITS * sides * rng.choice([-1.0, 1.0], JOINTS)
    return _through(times, poses, rng.uniform(0.0, 0.5, count), limits_of(harsh))


def emergency_stop(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves in step, some of which are braked at the limits on their way."""
    limits, places = limits_of(harsh), _pose(rng)
    parts = [places]
    segments: Segments = []
    while length_of(segments) < times[-1]:
        goal = _pose(rng)
        way = np.maximum(np.abs(goal - places), 1e-9)
        speed, change = np.min(limits.speeds / way), np.min(limits.accelerations / way)
        move = fastest_phases(1.0, 0.0, float(rng.uniform(0.5, 1.0) * speed), float(0.5 * change))
        if rng.uniform() < 0.6:
            move = cut(move, float(rng.uniform(0.3, 0.6)) * length_of(move))
            _, now = end_of(move)
            move += to_speed(now, 0.0, float(change))
        done, _ = end_of(move)
        # each move is a unit of the path, also one that ends early
        segments += [(lasts, a / done) for lasts, a in move]
        segments.append((float(rng.uniform(0.4, 2.0)), 0.0))
        places = places + done * (goal - places)
        parts.append(places)
    done_along = along(times, segments)
    numbers = np.arange(len(parts))
    return np.column_stack([np.interp(done_along, numbers, j) for j in np.array(parts).T])


def single_joint_jogs(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return jogs of whole degrees, 1 to 20, of one joint at a time."""
    count = _many(times, 0.2)
    poses = [np.clip(_pose(rng), 20.0 * DEGREE - LIMITS, LIMITS - 20.0 * DEGREE)]
    while len(poses) < count:
        joint = int(rng.integers(JOINTS))
        for _ in range(int(rng.integers(1, 6))):
            pose = poses[-1].copy()
            pose[joint] += DEGREE * float(rng.integers(1, 21)) * rng.choice([-1.0, 1.0])
            if abs(pose[joint]) <= LIMITS[joint]:
                poses.append(pose)
    dwells = rng.uniform(0.1, 0.6, len(poses))
    return _through(times, np.array(poses), dwells, limits_of(harsh))


def palletising(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a cycle between one place and a grid of others, each with lift and descent."""
    lift = np.array([0.0, 0.15, -0.1, 0.0, 0.0, 0.0])
    pick, place = 0.7 * _pose(rng), 0.7 * _pose(rng)
    column, row = (rng.uniform(0.03, 0.12, JOINTS) * rng.choice([-1.0, 1.0]) for _ in range(2))
    poses = [pick + lift]
    number = 0
    while len(poses) < _many(times, 0.2):
        target = place + (number % 3) * column + (number // 3 % 3) * row
        poses += [pick, pick + lift, target + lift, target, target + lift, pick + lift]
        number += 1
    paths = np.clip(np.array(poses), -LIMITS, LIMITS)
    dwells = np.tile([0.3, 0.0, 0.0, 0.3, 0.0, 0.0], number + 1)[: len(paths)]
    return _through(times, paths, dwells, limits_of(harsh), float(rng.uniform(0.03, 0.12)))


def pick_and_place(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves between two to four poses in turn, at the limits, with short dwells."""
    stations = np.array([_pose(rng, 0.8) for _ in range(rng.integers(2, 5))])
    count = _many(times, 0.2)
    poses = np.tile(stations, (math.ceil(count / len(stations)), 1))
    dwells = rng.uniform(0.2, 0.6) * np.ones(len(poses))
    return _through(times, poses, dwells, limits_of(harsh))


def weaving(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return slow moves in step with a fast swing of some joints, as in welding."""
    limits, count = limits_of(harsh), _many(times, 0.5)
    poses = np.array([_pose(rng, 0.65) for _ in range(count)])
    slow = _through(times, poses, rng.uniform(0.0, 0.5, count), limits.part(0.2, 0.2))
    rate = float(rng.uniform(5.0, 25.0))
    phase = along(times, [(1.0, rate)])
    return slow + _swings(rng, phase, rate, rate, limits.part(0.8, 0.8), 0.15 * LIMITS)


def _swings(
    rng: Generator,
    phase: FloatArray,
    rate: float,
    ramp: float,
    limits: Limits,
    largest: FloatArray,
) -> FloatArray:
    """Return swings of joints along a phase in rad, (N,), of their own shifts, from 0: (N, 6).

    Args:
        rate, ramp: largest rate and change of the phase, in rad/s and rad/s^2.
        largest: amplitude of each joint in rad, where limits allow it; half of them on average
            do not move.
    """
    by_acceleration = limits.accelerations / math.hypot(rate**2, ramp)
    most = np.minimum(np.minimum(limits.speeds / rate, by_acceleration), largest)
    moving = rng.permutation(np.arange(JOINTS)) < rng.integers(1, JOINTS + 1)
    amplitudes = moving * rng.uniform(0.4, 1.0, JOINTS) * most
    shifts = rng.uniform(0.0, 2.0 * math.pi, JOINTS)
    return amplitudes * (np.sin(phase[:, None] + shifts) - np.sin(shifts))


def circles_in_joint_space(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return closed curves about a pose, at a steady rate, reached from rest."""
    rate = float(rng.uniform(0.4, 6.0)) * (HARSH_SPEED if harsh else 1.0)
    phase = along(times, [(2.0, 0.5 * rate)])
    swing = _swings(rng, phase, rate, 0.5 * rate, limits_of(harsh), 0.35 * LIMITS)
    return 0.25 * _pose(rng) + swing


def sine_about_a_pose(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a sine of one joint about a pose, at a rate that may excite the socket."""
    rate = float(np.exp(rng.uniform(math.log(1.0), math.log(60.0))))
    phase = along(times, [(1.0, rate)])
    swing = _swings(rng, phase, rate, rate, limits_of(harsh), 0.4 * LIMITS)
    only = np.arange(JOINTS) == np.argmax(rng.uniform(size=JOINTS) * (np.ptp(swing, axis=0) > 0))
    return 0.2 * _pose(rng) + only * swing


def chirp_that_stops(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return swings of some joints that become faster, and stop at once."""
    top = float(rng.uniform(10.0, 50.0))
    ramp, brake = top / float(rng.uniform(0.5, 0.9) * times[-1]), 2.0 * top
    phase = along(times, [(top / ramp, ramp), (top / brake, -brake)])
    swing = _swings(rng, phase, top, brake, limits_of(harsh), 0.4 * LIMITS)
    return 0.2 * _pose(rng) + swing


def speed_override(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a closed curve that is run at 10 to 100 % of its speed, changed on the way."""
    rate, now = float(rng.uniform(1.0, 5.0)), 0.0

    def change() -> Segments:
        nonlocal now
        before, now = now, rate * float(rng.choice([0.1, 0.25, 0.5, 0.75, 1.0]))
        return [*to_speed(before, now, 2.0 * rate), (float(rng.uniform(0.5, 3.0)), 0.0)]

    phase = along(times, filled(float(times[-1]), change))
    swing = _swings(rng, phase, rate, 2.0 * rate, limits_of(harsh), 0.35 * LIMITS)
    return 0.25 * _pose(rng) + swing


def long_rest_then_run(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return long rests, each followed by a few moves at the limits."""
    count = _many(times, 0.2)
    poses = np.array([_pose(rng) for _ in range(count)])
    dwells = np.where(np.arange(count) % 3 == 0, rng.uniform(3.0, 7.0, count), 0.1)
    return _through(times, poses, dwells, limits_of(harsh))


def creep(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return joints that turn slowly, by 0.005 to 0.03 rad/s, each on its own."""

    def draw(joint: int) -> tuple[float, Segments]:
        now = 0.0

        def change() -> Segments:
            nonlocal now
            before, now = now, float(rng.uniform(0.005, 0.03) * rng.choice([-1.0, 1.0]))
            return [*to_speed(before, now, 0.2), (float(rng.uniform(2.0, 8.0)), 0.0)]

        begin = float(rng.uniform(-0.5, 0.5) * LIMITS[joint])
        return begin, filled(float(times[-1]), change)

    return _each(draw, times)


def coarse_set_points(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return set points for each 3 to 6 samples, joined by lines; harsh ones are held."""
    limits, each = limits_of(harsh), int(rng.integers(3, 7))
    step = float(times[1] - times[0])
    coarse = step * np.arange(0, len(times) + each, each)
    count = _many(times, 0.2)
    poses = np.array([_pose(rng) for _ in range(count)])
    dwells = rng.uniform(0.1, 0.6, count)
    if harsh:
        # a jump by d is a second difference of d / step^2
        slow = Limits(limits.accelerations * step / each, limits.accelerations)
        return np.repeat(_through(coarse, poses, dwells, slow), each, axis=0)[: len(times)]
    # a bend by dv is a second difference of dv / step, and dv is at most a * each * step
    given = _through(coarse, poses, dwells, limits.part(1.0, 1.0 / each))
    return np.column_stack([np.interp(times, coarse, joint) for joint in given.T])


def quantised_set_points(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return S-curve moves whose angles are rounded, to 0.01 degrees or 0.04 degrees."""
    limits, step = limits_of(harsh), float(times[1] - times[0])
    grid = (0.04 if harsh else 0.01) * DEGREE
    # rounding changes a second difference by at most twice the grid, a first one by the grid
    left = Limits(limits.speeds - grid / step, limits.accelerations - 2.0 * grid / step**2)
    count = _many(times, 0.2)
    poses = np.array([_pose(rng) for _ in range(count)])
    smooth = _through(times, poses, rng.uniform(0.1, 0.8, count), left, 0.1)
    return np.asarray(grid * np.round(smooth / grid))


def _states(system: System, rng: Generator, first: FloatArray) -> list[State]:
    """Return equilibrium, then two states in which the socket was bent and is released."""
    assert isinstance(system, RandomStates)
    others = [system.random_state(rng, first) for _ in range(2)]
    return [system.rest_state(first), *others]


JOINT_MOTIONS = Machine(
    lead=5.0,
    kinds={
        one.__name__: one
        for one in (
            minimum_time_on_their_own,
            bang_bang,
            minimum_time_moves,
            reversal_in_mid_move,
            s_curve_moves,
            whole_range_moves,
            emergency_stop,
            single_joint_jogs,
            palletising,
            pick_and_place,
            weaving,
            circles_in_joint_space,
            sine_about_a_pose,
            chirp_that_stops,
            speed_override,
            long_rest_then_run,
            creep,
            coarse_set_points,
            quantised_set_points,
        )
    },
    only={"creep": MODERATE},
    states=_states,
)
