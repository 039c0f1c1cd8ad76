"""Drives of a plant follow set points; their desired motion is part of the plant's state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization
from slide_fmu.systems.exudyn.plant import Plant


@dataclass(frozen=True, eq=False)
class SetPoints:
    """The desired motion of drives follows a uniform quadratic B-spline.

    The set points phi_k, which come once per sample, are the control points. From sample k to
    k + 1, with the newest set point phi_(k+1), the acceleration is constant,
    (phi_(k+1) - 2 phi_k + phi_(k-1)) / h^2; at sample k the rate is (phi_k - phi_(k-1)) / h and
    the position (phi_k + phi_(k-1)) / 2. So the motion lags half a step behind the set points, its
    velocity is continuous, and it needs nothing but the last three of them.

    Attributes:
        position: desired positions at a sample, shape (n,), in rad or m.
        rate: desired rates at this sample, shape (n,), in rad/s or m/s.
    """

    position: FloatArray
    rate: FloatArray

    @staticmethod
    def at_rest(position: FloatArray) -> SetPoints:
        """Return the motion of set points that have always been the same, shape (n,)."""
        return SetPoints(position, 0.0 * position)

    def newest(self, step: float) -> FloatArray:
        """Return the set point phi_k that came last, shape (n,), for the sample step h in s."""
        return self.position + 0.5 * step * self.rate

    def acceleration(self, set_points: FloatArray, step: float) -> FloatArray:
        """Return the constant acceleration per s^2 over the step in s to phi_(k+1), both (n,)."""
        return (set_points - self.newest(step) - step * self.rate) / step**2

    def after(self, time: float, acceleration: FloatArray) -> SetPoints:
        """Return the motion at a time in s within the step, or at its end."""
        return SetPoints(
            self.position + time * self.rate + 0.5 * time**2 * acceleration,
            self.rate + time * acceleration,
        )


class DrivenPlant:
    """The drives of a plant follow set points along a quadratic B-spline (SetPoints).

    The coordinates are the plant's and then the desired positions of the drives; the velocities
    are their rates, in the same order. Without a new set point before ``advance`` the drives
    continue at a constant rate.
    """

    def __init__(
        self,
        plant: Plant,
        step: float,
        drives: int,
        drive: Callable[[list[float], list[float]], None],
    ) -> None:
        """Take over a plant, whose ``before_substep`` is set here, with its step in s.

        ``drive`` is called with positions and rates of all drives, in rad or m and per s, and lets
        them follow.
        """
        self._plant, self._step, self._drives, self._drive = plant, step, drives, drive
        self._plan(SetPoints.at_rest(np.zeros(drives)))
        plant.before_substep = self.move

    def newest(self) -> FloatArray:
        """Return the set points that came last, shape (drives,), in rad or m."""
        return self._desired.newest(self._step)

    def follow(self, set_points: FloatArray) -> None:
        """Let the next step end with new set points, shape (drives,), in rad or m."""
        self._plan(self._desired, self._desired.acceleration(set_points, self._step))

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates and velocities, shape (n + drives,) each, in SI units."""
        self._plant.set_state(coordinates[: -self._drives], velocities[: -self._drives])
        self._plan(SetPoints(coordinates[-self._drives :], velocities[-self._drives :]))

    def coordinates(self) -> FloatArray:
        """Return coordinates and desired positions in SI units, shape (n + drives,)."""
        return np.concatenate([self._plant.coordinates(), self._desired.position])

    def velocities(self) -> FloatArray:
        """Return velocities and desired rates in SI units, shape (n + drives,)."""
        return np.concatenate([self._plant.velocities(), self._desired.rate])

    def advance(self) -> None:
        """Advance by one sample step.

        Raises:
            SimulationError: the integration failed; the state is still the one before.
        """
        self._plant.advance()
        self._plan(self._desired.after(self._step, self._acceleration))

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize the plant with its drives at a state, shape (n + drives,) each, in SI units.

        The matrices belong to the plant's n coordinates: the desired motion is prescribed and does
        not vary.
        """
        kept = self._desired, self._acceleration
        self._plan(SetPoints(coordinates[-self._drives :], velocities[-self._drives :]))
        try:
            return self._plant.linearize(coordinates[: -self._drives], velocities[: -self._drives])
        finally:
            self._plan(*kept)

    def _plan(self, desired: SetPoints, acceleration: FloatArray | None = None) -> None:
        """Set the desired motion from the last sample to the next; without one, no acceleration.

        It is kept as plain numbers too, since ``move`` is called before every substep.
        """
        self._desired = desired
        self._acceleration = np.zeros(self._drives) if acceleration is None else acceleration
        motion = (desired.position, desired.rate, self._acceleration)
        self._motion = list(zip(*(part.tolist() for part in motion), strict=True))

    def move(self, time: float) -> None:
        """Set the drives to the desired motion at a time in s since the last sample."""
        positions = [s + time * (rate + 0.5 * time * change) for s, rate, change in self._motion]
        rates = [rate + time * change for _, rate, change in self._motion]
        self._drive(positions, rates)
