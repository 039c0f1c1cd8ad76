"""Motions of a crank as users command them: indexing, jogging, run-ups, stops, turning by hand.

Moderate ones keep 8 rad/s and 20 rad/s^2, the limits of the training of the slider-crank. Harsh
ones keep 10 rad/s and 60 rad/s^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from kind_tables import MODERATE, Machine
from motion_profiles import (
    Segments,
    along,
    end_of,
    filled,
    smoothed,
    to_speed,
    turned,
)
from numpy.random import Generator

from mbs_models.slider_crank.slider_crank import SliderCrank
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.speed_profile import fastest_phases
from slide_fmu.systems.base import State, System

DEGREE = math.pi / 180.0
FINE = 8
"""Steps per sample by which a motion is summed up where it has no closed form."""


@dataclass(frozen=True)
class Limits:
    """Limits of a crank: speed in rad/s and acceleration in rad/s^2."""

    speed: float
    acceleration: float


MODERATE_LIMITS, HARSH_LIMITS = Limits(8.0, 20.0), Limits(10.0, 60.0)


def _limits(harsh: bool) -> Limits:
    return HARSH_LIMITS if harsh else MODERATE_LIMITS


def _director(rng: Generator, angles: FloatArray) -> FloatArray:
    """Return cosine and sine of angles that begin at any place."""
    turned_by = angles + rng.uniform(-math.pi, math.pi)
    return np.column_stack([np.cos(turned_by), np.sin(turned_by)])


def _acceleration(rng: Generator, harsh: bool) -> float:
    most = _limits(harsh).acceleration
    return float(rng.uniform(0.7, 1.0) * most)


def _moves(
    rng: Generator,
    times: FloatArray,
    limits: Limits,
    distances: tuple[float, float],
    dwells: tuple[float, float],
) -> Segments:
    """Return minimum-time moves with dwells, each forwards or backwards."""

    def move() -> Segments:
        distance = rng.uniform(*distances) * rng.choice([-1.0, 1.0])
        there = fastest_phases(float(distance), 0.0, limits.speed, limits.acceleration)
        return [*there, (float(rng.uniform(*dwells)), 0.0)]

    return filled(float(times[-1]), move)


def s_curve_moves(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves with limited jerk: the acceleration rises over 0.04 to 0.2 s."""
    limits = Limits(_limits(harsh).speed, _acceleration(rng, harsh))
    segments = _moves(rng, times, limits, (0.3, 12.0), (0.1, 1.0))
    span = float(rng.uniform(0.04, 0.2))
    return _director(rng, smoothed(lambda at: along(at, segments), times, span))


def minimum_time_moves(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves at the limits of speed and acceleration."""
    return _director(
        rng, along(times, _moves(rng, times, _limits(harsh), (0.2, 12.0), (0.1, 1.5)))
    )


def bang_bang(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return motions that always accelerate, one way or the other, at the limit."""
    limits, now = _limits(harsh), 0.0

    def change() -> Segments:
        nonlocal now
        before, now = now, float(rng.uniform(-1.0, 1.0) * limits.speed)
        return to_speed(before, now, limits.acceleration)

    return _director(rng, along(times, filled(float(times[-1]), change)))


def emergency_stop(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return mild run-ups, each of which ends with a brake at the limit."""
    limits = _limits(harsh)

    def stop() -> Segments:
        speed = float(rng.uniform(0.4, 1.0) * limits.speed * rng.choice([-1.0, 1.0]))
        start = to_speed(0.0, speed, float(rng.uniform(3.0, 8.0)))
        run, rest = rng.uniform(1.0, 4.0), rng.uniform(0.5, 2.0)
        brake = to_speed(speed, 0.0, limits.acceleration)
        return [*start, (float(run), 0.0), *brake, (float(rest), 0.0)]

    return _director(rng, along(times, filled(float(times[-1]), stop)))


def run_up_and_down(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return runs at nearly full speed, with the same acceleration up and down."""
    limits = _limits(harsh)

    def run() -> Segments:
        speed = float(rng.uniform(0.7, 1.0) * limits.speed * rng.choice([-1.0, 1.0]))
        change = float(rng.uniform(0.1, 1.0) * limits.acceleration)
        held, pause = float(rng.uniform(0.5, 4.0)), float(rng.uniform(0.0, 1.0))
        up, down = to_speed(0.0, speed, change), to_speed(speed, 0.0, change)
        return [*up, (held, 0.0), *down, (pause, 0.0)]

    return _director(rng, along(times, filled(float(times[-1]), run)))


def jog_by_degrees(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return jogs of whole degrees, 1 to 30, with short dwells."""
    limits = _limits(harsh)
    one_way = float(rng.choice([-1.0, 1.0]))

    def jog() -> Segments:
        side = one_way if rng.uniform() < 0.7 else -one_way
        distance = side * DEGREE * float(rng.integers(1, 31))
        there = fastest_phases(distance, 0.0, limits.speed, limits.acceleration)
        return [*there, (float(rng.uniform(0.05, 0.6)), 0.0)]

    return _director(rng, along(times, filled(float(times[-1]), jog)))


def creep(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return slow turning at 0.02 to 0.1 rad/s, which changes its direction."""
    now = 0.0

    def change() -> Segments:
        nonlocal now
        before, now = now, float(rng.uniform(0.02, 0.1) * rng.choice([-1.0, 1.0]))
        return [*to_speed(before, now, 0.5), (float(rng.uniform(2.0, 8.0)), 0.0)]

    return _director(rng, along(times, filled(float(times[-1]), change)))


def indexing_table(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a table that turns by the same part again and again, along a cycloid."""
    limits = _limits(harsh)
    part = 2.0 * math.pi / float(rng.integers(4, 25))
    # a cycloid has the largest speed 2 d / T and the largest acceleration 2 pi d / T^2
    quickest = max(
        2.0 * part / limits.speed, math.sqrt(2.0 * math.pi * part / limits.acceleration)
    )
    lasts = float(rng.uniform(1.0, 1.3)) * quickest
    cycle = lasts + float(rng.uniform(0.1, 0.8))
    done = np.floor(times / cycle)
    share = np.minimum((times - done * cycle) / lasts, 1.0)
    steps = done + share - np.sin(2.0 * math.pi * share) / (2.0 * math.pi)
    return _director(rng, part * steps * rng.choice([-1.0, 1.0]))


def quantised_angle(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return S-curve moves whose angles are rounded, to 0.1 degrees or 0.5 degrees."""
    limits, step = _limits(harsh), times[1] - times[0]
    grid = (0.5 if harsh else 0.1) * DEGREE
    # rounding changes a second difference by at most twice the grid, a first one by the grid
    left = Limits(
        limits.speed - grid / step,
        float(rng.uniform(0.3, 1.0)) * (limits.acceleration - 2.0 * grid / step**2),
    )
    segments = _moves(rng, times, left, (0.2, 9.0), (0.1, 1.0))
    smooth = smoothed(lambda at: along(at, segments), times, 0.1)
    return _director(rng, grid * np.round(smooth / grid))


def _rippled(rng: Generator, angles: FloatArray, limits: Limits, top: Limits) -> FloatArray:
    """Add waves over the angle of a motion, within limits; the motion keeps those at its top."""
    waves = float(rng.integers(2, 9))
    # with p = n a and the amplitude b: speed v (1 + b n), acceleration a (1 + b n) + b n^2 v^2
    by_speed = (limits.speed / top.speed - 1.0) / waves
    spare = limits.acceleration - top.acceleration
    by_acceleration = spare / (top.acceleration * waves + (waves * top.speed) ** 2)
    amplitude = rng.uniform(0.3, 0.95) * min(by_speed, by_acceleration)
    return np.asarray(angles + amplitude * np.sin(waves * angles))


def ripple_per_turn(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return steady turning with a ripple of 2 to 8 waves in each turn, as of a gear."""
    limits = _limits(harsh)
    top = Limits(float(rng.uniform(0.2, 0.8)) * limits.speed, 0.25 * limits.acceleration)
    now = 0.0

    def change() -> Segments:
        nonlocal now
        before, now = now, float(rng.uniform(-1.0, 1.0) * top.speed)
        return [*to_speed(before, now, top.acceleration), (float(rng.uniform(2.0, 7.0)), 0.0)]

    angles = along(times, filled(float(times[-1]), change))
    return _director(rng, _rippled(rng, angles, limits, top))


def hand_crank(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return turning by hand: faster on the way down, unsteady, with pauses and turns back."""
    limits, step = _limits(harsh), (times[1] - times[0]) / FINE
    speeds, held = _wishes(rng, step, FINE * len(times), limits)
    depth, lag = rng.uniform(0.15, 0.4), rng.uniform(0.0, 2.0 * math.pi)
    angle, speed, angles = 0.0, 0.0, [0.0]
    most = limits.acceleration * step
    for wish, steady in zip(speeds, held, strict=True):
        wanted = wish * (1.0 + depth * math.sin(angle + lag)) * steady
        wanted = min(max(wanted, -limits.speed), limits.speed)
        before, speed = speed, speed + min(max(wanted - speed, -most), most)
        angle += 0.5 * step * (before + speed)
        angles.append(angle)
    return _director(rng, np.array(angles[:-FINE:FINE]))


def _wishes(
    rng: Generator, step: float, count: int, limits: Limits
) -> tuple[FloatArray, FloatArray]:
    """Return wanted speeds of a hand, and how unsteady it is, at fine steps."""
    speeds = np.zeros(count)
    begin = 0
    while begin < count:
        end = begin + int(rng.uniform(1.0, 5.0) / step)
        resting = rng.uniform() < 0.2
        speeds[begin:end] = 0.0 if resting else rng.uniform(0.25, 0.8) * rng.choice([-1.0, 1.0])
        begin = end
    knots = 0.25 * np.arange(math.ceil(step * count / 0.25) + 1)
    slow = np.interp(step * np.arange(count), knots, rng.uniform(0.85, 1.15, len(knots)))
    return limits.speed * speeds, slow


def speed_modulated(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return turning whose speed goes up and down as a sine."""
    limits, rate = _limits(harsh), float(rng.uniform(0.5, 12.0))
    swing = float(rng.uniform(0.4, 0.95)) * min(0.5 * limits.speed, limits.acceleration / rate)
    mean = float(rng.uniform(0.0, 1.0)) * (limits.speed - swing)
    # begins at rest, at a time when the speed is the least, after a mild run-up
    run_up = to_speed(0.0, mean - swing, 0.3 * limits.acceleration)
    begin = run_up[0][0]
    after = np.maximum(times - begin, 0.0)
    wave = swing * (after - np.sin(rate * after) / rate)
    return _director(rng, (along(times, run_up) + wave) * rng.choice([-1.0, 1.0]))


def long_rest_then_run(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return long rests, each followed by a run at the limits."""
    limits = _limits(harsh)

    def run() -> Segments:
        speed = float(rng.uniform(0.5, 1.0) * limits.speed * rng.choice([-1.0, 1.0]))
        rest, held = float(rng.uniform(4.0, 9.0)), float(rng.uniform(1.0, 5.0))
        up = to_speed(0.0, speed, limits.acceleration)
        return [(rest, 0.0), *up, (held, 0.0), *to_speed(speed, 0.0, limits.acceleration)]

    return _director(rng, along(times, filled(float(times[-1]), run)))


def sine_about_a_pose(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a sine about a pose, whose rate rises from rest."""
    limits, rate = _limits(harsh), float(np.exp(rng.uniform(math.log(1.0), math.log(25.0))))
    ramp = float(rng.uniform(0.3, 1.0)) * rate
    return _director(rng, _swing(rng, turned(times, [(rate, 0.0)], ramp), rate, ramp, limits))


def _swing(
    rng: Generator, phase: FloatArray, rate: float, ramp: float, limits: Limits
) -> FloatArray:
    """Return the sine of a phase whose rate has limits; so have its speed and acceleration."""
    largest = min(limits.speed / rate, limits.acceleration / math.hypot(rate**2, ramp), math.pi)
    return np.asarray(rng.uniform(0.4, 1.0) * largest * np.sin(phase))


def chirp_that_stops(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a swing about a pose that becomes faster, and stops at once."""
    limits, top = _limits(harsh), float(rng.uniform(6.0, 20.0))
    ramp, brake = top / float(rng.uniform(0.5, 0.9) * times[-1]), 2.0 * top
    phase = along(times, [(top / ramp, ramp), (top / brake, -brake)])
    return _director(rng, _swing(rng, phase, top, brake, limits))


def reversing_trapezoid(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a speed that goes back and forth between two limits, with equal changes."""
    limits = _limits(harsh)
    speed, change = limits.speed * rng.uniform(0.4, 1.0), _acceleration(rng, harsh)
    held, now = float(rng.uniform(0.2, 2.0)), 0.0

    def reverse() -> Segments:
        nonlocal now
        before, now = now, float(-np.sign(now) * speed if now else speed)
        return [*to_speed(before, now, change), (held, 0.0)]

    return _director(rng, along(times, filled(float(times[-1]), reverse)))


def reversal_in_mid_move(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return moves that are called off on their way, for another goal."""
    limits, speed = _limits(harsh), 0.0

    def part() -> Segments:
        nonlocal speed
        goal = float(rng.uniform(-8.0, 8.0))
        there = fastest_phases(goal, speed, limits.speed, limits.acceleration)
        if rng.uniform() < 0.7:
            there = _called_off(rng, there)
        else:
            there = [*there, (float(rng.uniform(0.1, 0.8)), 0.0)]
        _, speed = end_of(there, speed)
        return there

    return _director(rng, along(times, filled(float(times[-1]), part)))


def _called_off(rng: Generator, segments: Segments) -> Segments:
    """Return a motion without a part of its cruise and without its brake."""
    first, (held, _), _ = segments
    return [first, (held * float(rng.uniform(0.0, 1.0)), 0.0)]


def set_points_of_a_slow_clock(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return set points for each 3 to 5 samples, joined by lines; harsh ones are held."""
    limits, count = _limits(harsh), int(rng.integers(3, 6))
    step = float(times[1] - times[0])
    coarse = step * np.arange(0, len(times) + count, count)
    if harsh:
        # a jump of the angle by d is a second difference of d / step^2
        slow = Limits(limits.acceleration * step / count, 1.0)
        given = along(coarse, _moves(rng, times, slow, (0.2, 3.0), (0.2, 1.0)))
        return _director(rng, np.repeat(given, count)[: len(times)])
    # a bend by dv is a second difference of dv / step, and dv is at most a * count * step
    mild = Limits(limits.speed, limits.acceleration / count)
    given = along(coarse, _moves(rng, times, mild, (0.3, 9.0), (0.1, 1.0)))
    return _director(rng, np.interp(times, coarse, given))


def _states(system: System, rng: Generator, first: FloatArray) -> list[State]:
    """Return rest at the first set point, then two running states near it, one each way."""
    assert isinstance(system, SliderCrank)
    place = math.atan2(first[1], first[0])
    others = [
        system.straight_state(place + float(rng.uniform(-0.3, 0.3)), speed)
        for speed in (MODERATE_LIMITS.speed, -MODERATE_LIMITS.speed)
    ]
    return [system.rest_state(first), *others]


CRANK = Machine(
    lead=8.0,
    kinds={
        one.__name__: one
        for one in (
            s_curve_moves,
            minimum_time_moves,
            bang_bang,
            emergency_stop,
            run_up_and_down,
            jog_by_degrees,
            creep,
            indexing_table,
            quantised_angle,
            ripple_per_turn,
            hand_crank,
            speed_modulated,
            long_rest_then_run,
            sine_about_a_pose,
            chirp_that_stops,
            reversing_trapezoid,
            reversal_in_mid_move,
            set_points_of_a_slow_clock,
        )
    },
    only={"creep": MODERATE},
    states=_states,
)
