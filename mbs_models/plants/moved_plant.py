"""One end of a spring moves along a smooth curve; its motion is part of the plant's state."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization
from slide_fmu.systems.exudyn.equilibrium import equilibrium
from slide_fmu.systems.exudyn.plant import Plant

T = TypeVar("T")

MOTION = 2
"""Coordinates of the motion: the position of the end, and its mean rate in the last step."""


class MovedPlant:
    """The end of a spring-damper goes through the positions that come once per sample.

    Between samples it moves along a cubic polynomial. Its rate at a sample is the derivative of
    the parabola through the last three positions, so that it is continuous: dampers do not feel
    jumps. States end with the position and the mean rate of the last step in their coordinates,
    and with the rate and a zero in their velocities, in SI units.
    """

    def __init__(self, plant: Plant, step: float, move: Callable[[float, float], None]) -> None:
        """Take over a plant, whose ``before_substep`` is set here, with its step in s.

        ``move`` is called with position and rate of the end, in rad or m and per s.
        """
        self._plant, self._step, self._move = plant, step, move
        plant.before_substep = self._before_substep
        self.position = self._rate = self._mean = self._next = 0.0

    @property
    def plant(self) -> MovedPlant:
        """The plant that ``PlantSystem`` steps."""
        return self

    def go(self, change: float) -> None:
        """Let the end move by a change in rad or m in the next step."""
        self._next = change / self._step

    def _before_substep(self, time: float) -> None:
        part, mean = time / self._step, self._next
        first, last = self._rate, self._rate_after()
        way = first * (1 - part) ** 2 + mean * part * (3 - 2 * part) - last * part * (1 - part)
        rate = first * (1 - part) * (1 - 3 * part) + last * part * (3 * part - 2)
        self._move(self.position + time * way, rate + 6 * mean * part * (1 - part))

    def _rate_after(self) -> float:
        return 1.5 * self._next - 0.5 * self._mean

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates and velocities, shape (n + MOTION,) each, in SI units."""
        self._plant.set_state(coordinates[:-MOTION], velocities[:-MOTION])
        self.position, self._mean = coordinates[-MOTION:].tolist()
        self._rate = self._next = float(velocities[-MOTION])

    def coordinates(self) -> FloatArray:
        """Return coordinates, those of the motion last, in SI units, shape (n + MOTION,)."""
        return np.append(self._plant.coordinates(), [self.position, self._mean])

    def velocities(self) -> FloatArray:
        """Return velocities, those of the motion last, in SI units, shape (n + MOTION,)."""
        return np.append(self._plant.velocities(), [self._rate, 0.0])

    def advance(self) -> None:
        """Advance by one sample step.

        Raises:
            SimulationError: the integration failed; the state is still the one before.
        """
        self._plant.advance()
        self.position += self._step * self._next
        self._rate, self._mean = self._rate_after(), self._next

    def equilibrium(self, position: float) -> FloatArray:
        """Return the coordinates at rest with the end at a position, shape (n + MOTION,).

        Raises:
            SimulationError: there are none, or they are not found.
        """
        with_motion = np.array([position, 0.0])
        found = self._at(with_motion, 0.0, lambda: equilibrium(self._plant))
        return np.append(found, with_motion)

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state, shape (n + MOTION,) each, in SI units; the end does not vary."""
        return self._at(
            coordinates[-MOTION:],
            float(velocities[-MOTION]),
            lambda: self._plant.linearize(coordinates[:-MOTION], velocities[:-MOTION]),
        )

    def _at(self, motion: FloatArray, rate: float, call: Callable[[], T]) -> T:
        """Call with the end at another motion, and go back to the present one."""
        kept = self.position, self._mean, self._rate, self._next
        self.position, self._mean = motion.tolist()
        self._rate = self._next = rate
        try:
            return call()
        finally:
            self.position, self._mean, self._rate, self._next = kept
