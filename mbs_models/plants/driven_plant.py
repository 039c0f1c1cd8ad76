"""A driven plant is an implicit plant with drives; the motion they follow is part of its state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbs_models.plants.set_points import SetPoints
from mbs_models.plants.solver import ImplicitPlant
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization


class DrivenPlant:
    """The drives of an implicit plant follow set points along a quadratic B-spline (SetPoints).

    The coordinates are those of the plant and then the desired positions of the drives; the
    velocities are their rates, in the same order. Without a new set point before ``advance`` the
    drives go on with constant rate.
    """

    def __init__(
        self,
        plant: ImplicitPlant,
        step: float,
        drives: int,
        drive: Callable[[list[float], list[float]], None],
    ) -> None:
        """Take over a plant, whose ``before_substep`` is set here, with its step in s.

        ``drive`` is called with positions and rates of all drives, in rad or m and per s, and lets
        them follow.
        """
        self._plant, self._step, self._drives, self._drive = plant, step, drives, drive
        self._plan(SetPoints.at_rest(np.zeros(drives)), np.zeros(drives))
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
        desired = SetPoints(coordinates[-self._drives :], velocities[-self._drives :])
        self._plan(desired, np.zeros(self._drives))

    def coordinates(self) -> FloatArray:
        """Return coordinates and desired positions in SI units, shape (n + drives,)."""
        return np.concatenate([self._plant.coordinates(), self._desired.position])

    def velocities(self) -> FloatArray:
        """Return velocities and desired rates in SI units, shape (n + drives,)."""
        return np.concatenate([self._plant.velocities(), self._desired.rate])

    def advance(self) -> None:
        """Go on by one sample step.

        Raises:
            SimulationError: the integration failed; the state is still the one before.
        """
        self._plant.advance()
        reached = self._desired.after(self._step, self._acceleration)
        self._plan(reached, np.zeros(self._drives))

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize the plant with its drives at a state, shape (n + drives,) each, in SI units.

        The matrices are those of the plant's n coordinates: the desired motion is given from
        outside and does not vary.
        """
        kept = self._desired, self._acceleration
        desired = SetPoints(coordinates[-self._drives :], velocities[-self._drives :])
        self._plan(desired, np.zeros(self._drives))
        try:
            return self._plant.linearize(coordinates[: -self._drives], velocities[: -self._drives])
        finally:
            self._plan(*kept)

    def _plan(self, desired: SetPoints, acceleration: FloatArray) -> None:
        """Set the desired motion from the last sample to the next.

        It is kept as plain numbers too, since ``move`` is called before every substep.
        """
        self._desired, self._acceleration = desired, acceleration
        self._motion = list(
            zip(
                desired.position.tolist(),
                desired.rate.tolist(),
                acceleration.tolist(),
                strict=True,
            )
        )

    def move(self, time: float) -> None:
        """Set the drives to the desired motion at a time in s since the last sample."""
        positions = [s + time * (rate + 0.5 * time * change) for s, rate, change in self._motion]
        rates = [rate + time * change for _, rate, change in self._motion]
        self._drive(positions, rates)
