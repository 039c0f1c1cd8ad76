"""Axes move as drives are driven: jogs, long moves, stops and reversals, up to their limits.

A drive's controller moves an axis in the least time that its limits of speed and acceleration
allow, and limits the jerk by a moving average over the set points (Biagiotti and Melchiorri,
"Trajectory Planning for Automatic Machines and Robots", 2008, chapter 4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from slide_fmu.core.signals import FloatArray, Signal, by_axis
from slide_fmu.core.units import ratio
from slide_fmu.excitation.base import CountRange, Kind, Limits
from slide_fmu.excitation.descriptions import between, with_unit
from slide_fmu.excitation.speed_profile import fastest_phases

FULL_TURN = 2 * math.pi

DISTANCE = (0.003, 1.0)
"""Range of the length of a move, as a part of the range of its axis: from a jog to all of it."""
MOST_TURNS = 5.0
"""Longest move of an angle, in turns; jogs are parts of a turn."""
EFFORT = (0.2, 1.0)
"""Range of the part of a limit that a move uses, where it does not use both limits in full."""
AT_LIMITS = 0.5
"""Share of the moves that use both limits in full."""
SMOOTHING = (0.01, 0.75)
"""Range of the length of the moving average, as a part of the time to full speed."""
REST = (0.1, 5.0)
"""Range of the length of a rest, as a multiple of the time to full speed."""
RESTS = 0.4
"""Share of the moves after which the axis rests."""
KEPT = 0.2
"""Share of the moves in which the axis stays where it is."""
BROKEN = 0.2
"""Share of the moves that are broken off."""
STOPS = 0.5
"""Share of the moves that were broken off after which the axis stops; else it moves on."""


@dataclass(frozen=True)
class _Axis:
    """What one axis can do, in its unit.

    Attributes:
        low: lower end of its range; minus infinity for an angle.
        high: upper end.
        width: width of the range; a full turn for an angle.
        distance: range of the length of a move, as a part of the width.
        speed: limit of the speed, per s.
        acceleration: limit of the acceleration, per s^2.
    """

    low: float
    high: float
    width: float
    distance: tuple[float, float]
    speed: float
    acceleration: float


@dataclass(frozen=True, eq=False)
class _Path:
    """Positions of an axis: pieces of constant acceleration, the last one without an end.

    Attributes:
        start: time in s at which each piece starts, ascending, shape (n,).
        position: position at that time, shape (n,).
        speed: speed at that time, shape (n,).
        acceleration: acceleration in the piece, shape (n,).
    """

    start: FloatArray
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    def averaged(self, time: FloatArray, over: float) -> FloatArray:
        """Return the mean position over the last ``over`` s, at times in s; shape (N,).

        The mean is exact. It keeps the limits of position, speed and acceleration; the
        acceleration changes linearly instead of by jumps.
        """
        lengths = np.diff(self.start)
        before = np.concatenate(
            [[0.0], np.cumsum(self._integral(np.arange(len(lengths)), lengths))]
        )

        def integral(until: FloatArray) -> FloatArray:
            piece = np.searchsorted(self.start, until, side="right") - 1
            return np.asarray(before[piece] + self._integral(piece, until - self.start[piece]))

        return (integral(time) - integral(time - over)) / over

    def _integral(self, piece: np.ndarray, elapsed: FloatArray) -> FloatArray:
        """Integrate the position from the start of pieces over elapsed times in s."""
        thirds = self.speed[piece] / 2 + elapsed * self.acceleration[piece] / 6
        return np.asarray(elapsed * (self.position[piece] + elapsed * thirds))


class AxisMoves(Kind):
    """Each axis moves from target to target in the least time that its limits allow.

    An input is the position of an axis. Cosine and sine of an angle, declared as such, are one
    axis that turns without end. Moves have all lengths, from jogs to the whole range. Some are
    broken off: the axis stops as fast as it can, or turns to another target at once. A moving
    average limits the jerk. Each axis moves on its own. The amplitude factor multiplies the limits
    of speed and acceleration; positions stay in range.

    Attributes:
        speed: limit of each axis' speed, in its unit per s (rad/s for cosine and sine).
        acceleration: limit of each axis' acceleration, in its unit per s^2.
        hold: range of the number of samples for which set points are held, drawn for each
            trajectory, as by a controller with a slower clock. A held set point jumps, so choose a
            lower speed. Without it, set points move at every sample.
    """

    drives_axes: ClassVar[bool] = True

    kind: Literal["axis_moves"]
    speed: Limits = Field(min_length=1)
    acceleration: Limits = Field(min_length=1)
    hold: CountRange | None = None

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse limits that are not one for each axis.

        Raises:
            ValueError: the number of limits is not the number of axes.
        """
        names = [" and ".join(signal.name for signal in axis) for axis in by_axis(signals)]
        for name, limits in (("speed", self.speed), ("acceleration", self.acceleration)):
            if len(limits) != len(names):
                raise ValueError(
                    f"kind = 'axis_moves': {name} has {len(limits)} values; expected "
                    f"{len(names)}, one for each axis {names}: correct the list, or declare "
                    "cosine and sine of an angle as such"
                )

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        units = ["rad" if axis[0].angle else axis[0].unit for axis in by_axis(signals)]
        limits = [
            ", ".join(
                with_unit(f"{value:g}", ratio(unit, per))
                for value, unit in zip(values, units, strict=True)
            )
            for values, per in ((self.speed, "s"), (self.acceleration, "s^2"))
        ]
        return (
            f"{'the axis moves' if len(units) == 1 else 'every axis moves on its own'} from "
            f"target to target, near and far, at speeds of up to {limits[0]} and accelerations of "
            f"up to {limits[1]} (a box: moves reach both); some moves stop or turn back on the "
            "way" + self._described_hold(step)
        )

    def _described_hold(self, step: float) -> str:
        if self.hold is None:
            return ""
        return (
            f"; set points are held for {between((step * self.hold[0], step * self.hold[1]), 's')}"
        )

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw the positions of all axes at the sample times, shape (N, n_inputs)."""
        smoothing = _between(SMOOTHING, rng)
        elapsed = time - time[0]
        if self.hold is not None:
            elapsed = _held(elapsed, self.hold, rng)
        columns: list[FloatArray] = []
        for axis, speed, acceleration in zip(
            by_axis(signals), self.speed, self.acceleration, strict=True
        ):
            limits = _axis_of(axis, factor * speed, factor * acceleration)
            over = smoothing * speed / acceleration
            path = _path(limits, float(time[-1] - time[0]), over, rng)
            position = path.averaged(elapsed, over)
            if axis[0].angle is None:
                columns.append(np.clip(position, limits.low, limits.high))  # of rounding
            else:
                length = axis[0].high
                columns += [length * np.cos(position), length * np.sin(position)]
        return np.stack(columns, axis=1)


def _held(time: FloatArray, hold: tuple[int, int], rng: np.random.Generator) -> FloatArray:
    """Return the time in s at which a slower clock took the set point of each sample, (N,)."""
    count = int(rng.integers(hold[0], hold[1] + 1))
    begun = int(rng.integers(count))  # samples since the slower clock ticked, at the first one
    sample = np.arange(len(time))
    return np.asarray(time[np.maximum(sample - (sample + begun) % count, 0)])


def _path(axis: _Axis, until: float, over: float, rng: np.random.Generator) -> _Path:
    """Draw moves that begin ``over`` s before 0, or earlier, and last until ``until`` in s."""
    position = axis.width * rng.random() + (axis.low if math.isfinite(axis.low) else 0.0)
    speed, least, rows = 0.0, 0.0, list[tuple[float, float, float, float]]()
    begin = -over - rng.random() * axis.speed / axis.acceleration
    while begin <= until:
        fastest, acceleration = _limits(axis, least, rng)
        way = _way(axis, position, speed, acceleration, rng)
        phases = fastest_phases(way, speed, fastest, acceleration)
        whole = sum(length for length, _ in phases)
        broken = rng.random() < BROKEN
        left = rng.random() * whole if broken else whole
        for length, of_phase in phases:
            lasts = min(length, left)
            rows.append((begin, position, speed, of_phase))
            position += lasts * (speed + 0.5 * lasts * of_phase)
            speed += lasts * of_phase
            begin, left = begin + lasts, left - lasts
        # what is broken off can stop in range if it brakes as it would have
        least = acceleration if broken else 0.0
        if not broken:
            speed = 0.0  # but for rounding
            rows.append((begin, position, speed, 0.0))
            begin += _rest(axis, whole == 0.0, rng)
    return _Path(*np.array(rows).T)


def _limits(axis: _Axis, least: float, rng: np.random.Generator) -> tuple[float, float]:
    """Draw highest speed and acceleration of a move; ``least`` is the lowest acceleration."""
    effort = (1.0, 1.0) if rng.random() < AT_LIMITS else EFFORT
    speed = axis.speed * _between(effort, rng)
    return speed, max(axis.acceleration * _between(effort, rng), least)


def _way(
    axis: _Axis,
    position: float,
    speed: float,
    acceleration: float,
    rng: np.random.Generator,
) -> float:
    """Draw how far an axis moves: to a target, to where it can stop, or not at all."""
    if speed != 0.0 and rng.random() < STOPS:
        return 0.5 * speed * abs(speed) / acceleration
    if speed == 0.0 and rng.random() < KEPT:
        return 0.0
    return _target(axis, position, rng) - position


def _rest(axis: _Axis, kept: bool, rng: np.random.Generator) -> float:
    """Draw the time in s after a move; where the position was kept, it is a rest always."""
    rests = kept or rng.random() < RESTS
    return _between(REST, rng) * axis.speed / axis.acceleration if rests else 0.0


def _target(axis: _Axis, position: float, rng: np.random.Generator) -> float:
    """Draw the next target, in range: the other way, or nearer, where it would be outside."""
    way = axis.width * _between(axis.distance, rng) * (1 if rng.random() < 0.5 else -1)
    if not axis.low <= position + way <= axis.high:
        way = -way
    return min(max(position + way, axis.low), axis.high)


def _between(pair: tuple[float, float], rng: np.random.Generator) -> float:
    """Draw a value whose logarithm is uniform between those of both ends."""
    return math.exp(rng.uniform(math.log(pair[0]), math.log(pair[1])))


def _axis_of(signals: tuple[Signal, ...], speed: float, acceleration: float) -> _Axis:
    if signals[0].angle is not None:
        turns = (DISTANCE[0], MOST_TURNS)
        return _Axis(-math.inf, math.inf, FULL_TURN, turns, speed, acceleration)
    (signal,) = signals
    width = signal.high - signal.low
    return _Axis(signal.low, signal.high, width, DISTANCE, speed, acceleration)
