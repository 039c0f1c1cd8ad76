"""One end of a spring moves along straight lines; its motion is part of the plant's state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization
from slide_fmu.systems.exudyn.plant import Plant


class MovedPlant:
    """The end of a spring-damper moves at a constant rate within each step.

    The last coordinate of its states is the position of the end, in rad or m, and the last
    velocity its rate in the step that ended there: forces at the end of a step follow it.
    """

    def __init__(self, plant: Plant, step: float, move: Callable[[float, float], None]) -> None:
        """Take over a plant, whose ``before_substep`` is set here, with its step in s.

        ``move`` is called with position and rate of the end, in rad or m and per s.
        """
        self._plant, self._step, self._move = plant, step, move
        plant.before_substep = self._before_substep
        plant.continuous = False  # the rate jumps from step to step
        self.position = self._rate = 0.0

    @property
    def plant(self) -> MovedPlant:
        """The plant that ``PlantSystem`` steps."""
        return self

    def go(self, change: float) -> None:
        """Let the end move by a change in rad or m in the next step."""
        self._rate = change / self._step

    def _before_substep(self, time: float) -> None:
        self._move(self.position + time * self._rate, self._rate)

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates and velocities, shape (n + 1,) each, in SI units."""
        self._plant.set_state(coordinates[:-1], velocities[:-1])
        self.position, self._rate = float(coordinates[-1]), float(velocities[-1])

    def coordinates(self) -> FloatArray:
        """Return coordinates and the position of the end in SI units, shape (n + 1,)."""
        return np.append(self._plant.coordinates(), self.position)

    def velocities(self) -> FloatArray:
        """Return velocities and the rate of the end in SI units, shape (n + 1,)."""
        return np.append(self._plant.velocities(), self._rate)

    def advance(self) -> None:
        """Advance by one sample step.

        Raises:
            SimulationError: the integration failed; the state is still the one before.
        """
        self._plant.advance()
        self.position += self._step * self._rate

    def equilibrium(self, position: float) -> FloatArray:
        """Return the coordinates at rest with the end at a position, shape (n + 1,).

        Raises:
            SimulationError: exudyn's static solver does not find them.
        """
        kept = self.position, self._rate
        self.position, self._rate = position, 0.0
        try:
            return np.append(self._plant.equilibrium(), position)
        finally:
            self.position, self._rate = kept

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state, shape (n + 1,) each, in SI units; the end does not vary."""
        kept = self.position, self._rate
        self.position, self._rate = float(coordinates[-1]), float(velocities[-1])
        try:
            return self._plant.linearize(coordinates[:-1], velocities[:-1])
        finally:
            self.position, self._rate = kept
