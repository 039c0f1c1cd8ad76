"""Positions over time of motions whose speed and acceleration are limited, in closed form.

A motion is a list of segments of constant acceleration. Differences of samples are means of speed
and acceleration, so samples keep the limits of both too.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slide_fmu.core.signals import FloatArray

Segments = list[tuple[float, float]]
"""Duration in s and acceleration of each segment, one after the other, from rest."""

PARTS = 16
"""A smoothed motion is the mean of this number of earlier positions."""
FOREVER = 1e9
"""A motion keeps its last speed for this time in s."""


def along(times: FloatArray, segments: Segments) -> FloatArray:
    """Return the positions of a motion that begins at 0, at rest, at the time 0."""
    durations, accelerations = np.array([*segments, (FOREVER, 0.0)]).T
    changes = accelerations * durations
    speeds = np.concatenate([[0.0], np.cumsum(changes)])[:-1]
    moved = speeds * durations + 0.5 * changes * durations
    begins = np.concatenate([[0.0], np.cumsum(durations)])[:-1]
    places = np.concatenate([[0.0], np.cumsum(moved)])[:-1]
    times = np.maximum(times, 0.0)
    k = np.searchsorted(begins, times, side="right") - 1
    after = times - begins[k]
    return np.asarray(places[k] + speeds[k] * after + 0.5 * accelerations[k] * after**2)


def smoothed(
    positions: Callable[[FloatArray], FloatArray], times: FloatArray, span: float
) -> FloatArray:
    """Return positions whose acceleration rises over a span in s, as in an S-curve.

    They are means over the span, so no limit of speed or acceleration is exceeded.
    """
    offsets = span * (np.arange(PARTS) + 0.5) / PARTS
    return np.asarray(np.mean([positions(times - offset) for offset in offsets], axis=0))


def to_speed(now: float, wanted: float, acceleration: float) -> Segments:
    """Return the change from one speed to another by an acceleration, given as positive."""
    return [(abs(wanted - now) / acceleration, math.copysign(acceleration, wanted - now))]


def cut(segments: Segments, time: float) -> Segments:
    """Return the part of a motion up to a time in s."""
    kept: Segments = []
    for duration, acceleration in segments:
        kept.append((min(duration, time), acceleration))
        time -= duration
        if time <= 0.0:
            break
    return kept


def end_of(segments: Segments, speed: float = 0.0) -> tuple[float, float]:
    """Return distance and speed at the end of segments that begin at a speed."""
    distance = 0.0
    for duration, acceleration in segments:
        distance += speed * duration + 0.5 * acceleration * duration**2
        speed += acceleration * duration
    return distance, speed


def length_of(segments: Segments) -> float:
    """Return the duration of a motion in s."""
    return sum(duration for duration, _ in segments)


def filled(duration: float, draw: Callable[[], Segments]) -> Segments:
    """Return drawn parts of a motion, one after the other, for at least a duration in s."""
    found: Segments = []
    lasting = 0.0
    while lasting < duration:
        part = draw()
        found += part
        lasting += length_of(part)
    return found


def turned(times: FloatArray, rates: list[tuple[float, float]], ramp: float) -> FloatArray:
    """Return a phase in rad whose rate goes from one value to the next, at most by a ramp.

    Args:
        rates: rate in rad/s and time in s for which it is held, one after the other; the last
            one is held for good. The first one is reached from rest.
        ramp: change of the rate in rad/s^2.
    """
    segments: Segments = []
    now = 0.0
    for rate, held in rates:
        segments += [*to_speed(now, rate, ramp), (held, 0.0)]
        now = rate
    return along(times, segments)
