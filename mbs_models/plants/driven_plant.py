"""An implicit plant with drives; the motion that they shall follow is part of its state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbs_models.plants.set_points import SetPoints
from mbs_models.plants.solver import ImplicitPlant
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization


class DrivenPlant:
    """An implicit plant whose drives follow set points along a quadratic B-spline.

    Its coordinates are those of the plant and then the desired positions of the drives, its
    velocities likewise; see SetPoints. Without a new set point before ``advance`` the drives go
    on with constant rate.
    """

    def __init__(
        self,
        plant: ImplicitPlant,
        step: float,
        drives: int,
        drive: Callable[[list[float], list[float]], None],
    ) -> None:
        """Take over a plant.

        Args:
            plant: the mechanism; its ``before_substep`` is set here.
            step: sample step h in s.
            drives: number of drives.
            drive: lets the drives follow positions and rates, one of each per drive.
        """
        self._plant, self._step, self._drives, self._drive = plant, step, drives, drive
        self._plan(SetPoints.at_rest(np.zeros(drives)), np.zeros(drives))
        plant.before_substep = self.move

    def newest(self) -> FloatArray:
        """The set points that came last, shape (drives,)."""
        return self._desired.newest(self._step)

    def follow(self, set_points: FloatArray) -> None:
        """Let the next step end with new set points, shape (drives,)."""
        self._plan(self._desired, self._desired.acceleration(set_points, self._step))

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates and velocities, shape (n + drives,) each, in SI units."""
        self._plant.set_state(coordinates[: -self._drives], velocities[: -self._drives])
        desired = SetPoints(coordinates[-self._drives :], velocities[-self._drives :])
        self._plan(desired, np.zeros(self._drives))

    def coordinates(self) -> FloatArray:
        """Coordinates and desired positions, shape (n + drives,)."""
        return np.concatenate([self._plant.coordinates(), self._desired.position])

    def velocities(self) -> FloatArray:
        """Velocities and desired rates, shape (n + drives,)."""
        return np.concatenate([self._plant.velocities(), self._desired.rate])

    def advance(self) -> None:
        """Go on by one sample step.

        Raises:
            SimulationError: see ImplicitPlant; the state is still the one before.
        """
        self._plant.advance()
        reached = self._desired.after(self._step, self._acceleration)
        self._plan(reached, np.zeros(self._drives))

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize the plant with its drives at a state, shape (n + drives,) each.

        The matrices are those of the plant's n coordinates, the desired motion does not vary.
        """
        kept = self._desired, self._acceleration
        desired = SetPoints(coordinates[-self._drives :], velocities[-self._drives :])
        self._plan(desired, np.zeros(self._drives))
        try:
            return self._plant.linearize(coordinates[: -self._drives], velocities[: -self._drives])
        finally:
            self._plan(*kept)

    def _plan(self, desired: SetPoints, acceleration: FloatArray) -> None:
        """Desired motion at the last sample and until the next; as numbers too, for speed."""
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
        """Set the drives for a time in s since the last sample."""
        positions = [s + time * (rate + 0.5 * time * change) for s, rate, change in self._motion]
        rates = [rate + time * change for _, rate, change in self._motion]
        self._drive(positions, rates)
