"""All joints of a machine move from point to point together, with trapezoidal speed.

This is the excitation of the paper's robot (section "Spatial 6R manipulator on a flexible
socket"), with limits, pauses and moves of single joints added.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.base import Kind, Limits, PositiveRange, Share, require_one_each
from slide_fmu.excitation.descriptions import between, listed
from slide_fmu.excitation.speed_profile import SpeedProfiles


def _half_at_most(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[1] > 0.5:
        raise ValueError("expected at most 0.5: a move speeds up and slows down")
    return pair


Ramp = Annotated[PositiveRange, AfterValidator(_half_at_most)]
"""Range of the share of a move that each of its two accelerated phases takes."""


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves follow each other; the joints rest before, between and after them.

    Attributes:
        start: time in s at which each move starts, shape (n_moves,). The time between the end
            of a move and the start of the next is a dwell.
        duration: duration of each move in s, shape (n_moves,).
        ramp: share of the duration in which a move speeds up, and again in which it slows down,
            shape (n_moves,).
        positions: positions of the joints before each move and after the last one, in the
            joints' units, shape (n_moves + 1, n_joints).
    """

    start: FloatArray
    duration: FloatArray
    ramp: FloatArray
    positions: FloatArray

    def at(self, time: FloatArray) -> FloatArray:
        """Return positions in the joints' units, shape (N, n_joints), at times in s, (N,).

        No time lies before the first move.
        """
        move = np.searchsorted(self.start, time, side="right") - 1
        phase = np.minimum((time - self.start[move]) / self.duration[move], 1.0)
        way = SpeedProfiles.sharp(self.ramp[move]).way(phase)[:, None]
        return self.positions[move] + way * (self.positions[move + 1] - self.positions[move])


class PointToPoint(Kind):
    """All joints move from point to point, start and arrive together, and rest between moves.

    Every input is the position of one joint. The speed of a move is a trapezoid in time: constant
    acceleration, constant speed, the same deceleration. Moves may start and end between samples.
    The defaults, without limits, are the motion of the SLIDE paper's robot.

    With the amplitude factor f the same motion runs f times as fast: times are divided by f,
    speeds multiplied by f, accelerations by f^2, and so are their limits. Positions stay in
    range.

    Attributes:
        duration: range of the duration of a move in s, drawn uniformly.
        ramp: range of the share of the duration that each of the two ramps takes; 0.5 is constant
            acceleration, then the same deceleration.
        speed: limit of each joint's speed, in its unit per s; no limit if empty. Moves that would
            exceed a limit take longer.
        acceleration: limit of each joint's acceleration, in its unit per s^2; no limit if empty.
        reach: part of each joint's range, about its middle, in which target positions are drawn.
        keep: share of the moves in which a random number of random joints, at least one and
            perhaps all, keep their position.
        single: share of the moves in which one random joint moves alone.
        dwell: share of the moves after which the joints rest for a while.
        dwell_duration: range of the time of these rests in s, drawn uniformly.
    """

    drives_axes: ClassVar[bool] = True

    kind: Literal["point_to_point"]
    duration: PositiveRange = (1.0, 1.0)
    ramp: Ramp = (0.5, 0.5)
    speed: Limits = ()
    acceleration: Limits = ()
    reach: float = Field(default=1.0, gt=0, le=1)
    keep: Share = 0.2
    single: Share = 0.0
    dwell: Share = 0.0
    dwell_duration: PositiveRange = (0.1, 1.0)

    @model_validator(mode="after")
    def _shares_fit(self) -> PointToPoint:
        if self.keep + self.single > 1:
            raise ValueError(
                f"keep = {self.keep}, single = {self.single}; expected shares of the moves, "
                "together at most 1"
            )
        return self

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse limits that are not one for each input.

        Raises:
            ValueError: the number of limits is neither 0 nor the number of inputs.
        """
        for name, limits in (("speed", self.speed), ("acceleration", self.acceleration)):
            if limits:
                require_one_each(self.kind, name, limits, signals)

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        text = (
            "all inputs together move from point to point within "
            f"{100 * self.reach:g} % of their ranges, in {between(self.duration, 's')}"
        )
        speed, acceleration = self._largest(signals)
        text += f", at speeds of up to {listed(speed, signals, 's')}"
        text += f", with accelerations of up to {listed(acceleration, signals, 's^2')}"
        if self.dwell:
            rests = between(self.dwell_duration, "s")
            text += f", and rest after {100 * self.dwell:g} % of the moves for {rests}"
        for share, what in ((self.keep, "some stay"), (self.single, "one alone moves")):
            if share:
                text += f"; in {100 * share:g} % of the moves {what}"
        return text

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw the positions of all joints at the sample times, shape (N, n_joints)."""
        elapsed = factor * (time - time[0])
        moves = self.moves(signals, float(elapsed[-1]), rng)
        low, high = _ends(signals)
        return np.clip(moves.at(elapsed), low, high)  # rounding may move a target out of its range

    def moves(self, signals: tuple[Signal, ...], until: float, rng: np.random.Generator) -> Moves:
        """Draw moves that cover the time from 0 to ``until`` in s, at amplitude factor 1.

        The first one begins at a random time of up to its duration before 0.
        """
        position = self._target(signals, rng)
        positions, clock = [position], 0.0
        rows: list[tuple[float, float, float]] = []
        while not rows or clock <= until:
            position = np.where(
                self._moving(len(signals), rng), self._target(signals, rng), position
            )
            ramp = rng.uniform(*self.ramp)
            duration = self._feasible_duration(
                rng.uniform(*self.duration), ramp, positions[-1] - position
            )
            if not rows:  # it begins within a move, so that not all trajectories begin at rest
                clock = -rng.uniform(0, duration)
            positions.append(position)
            rows.append((clock, duration, ramp))
            rest = rng.random() < self.dwell
            clock += duration + (rng.uniform(*self.dwell_duration) if rest else 0.0)
        start, durations, ramps = np.array(rows).T
        return Moves(start, durations, ramps, np.array(positions))

    def _largest(self, signals: tuple[Signal, ...]) -> tuple[Limits, Limits]:
        """Return the largest speeds and accelerations of all inputs; they are limits if given."""
        low, high = _ends(signals)
        way, shortest = self.reach * (high - low), self.duration[0]
        of_speed, of_acceleration, _ = SpeedProfiles.sharp(np.array(self.ramp)).inverse_peaks()
        speed = way / of_speed.min() / shortest
        acceleration = way / of_acceleration.min() / shortest**2
        return (
            self.speed or tuple(float(f"{value:.3g}") for value in speed),
            self.acceleration or tuple(float(f"{value:.3g}") for value in acceleration),
        )

    def _target(self, signals: tuple[Signal, ...], rng: np.random.Generator) -> FloatArray:
        low, high = _ends(signals)
        middle, half_range = 0.5 * (low + high), 0.5 * self.reach * (high - low)
        return np.asarray(rng.uniform(middle - half_range, middle + half_range))

    def _moving(self, count: int, rng: np.random.Generator) -> NDArray[np.bool_]:
        """Draw which joints move, as booleans of shape (n_joints,)."""
        choice, order = rng.random(), rng.permutation(count)
        if choice < self.single:
            return np.asarray(order == 0)
        kept = int(np.ceil(count * (1 - rng.random()))) if choice < self.single + self.keep else 0
        return np.asarray(order >= kept)

    def _feasible_duration(self, duration: float, ramp: float, way: FloatArray) -> float:
        """Return the duration of a move in s, or the shortest one that keeps all limits."""
        unlimited = np.full(len(way), np.inf)
        limits = [np.array(each or unlimited) for each in (self.speed, self.acceleration)]
        profile = SpeedProfiles.sharp(np.array([ramp]))
        return max(duration, float(profile.least_times(way, limits)[0]))


def _ends(signals: tuple[Signal, ...]) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper ends of the ranges, shape (n_inputs,) each."""
    return np.array([s.low for s in signals]), np.array([s.high for s in signals])
