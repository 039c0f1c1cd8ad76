"""Systems for loops: a spring that answers at once, and a mass on a spring, stepped exactly."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray, Hold, Signal
from slide_fmu.systems.base import Stepping, System

STIFFNESS, MASS = 2000.0, 5.0


class Spring(Stepping):
    """A spring between a road and a place: it pushes the place towards the road."""

    def __init__(self, step: float, sign: float = 1.0, hold: str = "first_order") -> None:
        """Take the sign of the force, and the hold of the inputs."""
        held: Hold = "first_order" if hold == "first_order" else "zero_order"
        self.step, self._sign = step, sign
        self.inputs = (
            Signal("road", "m", -0.05, 0.05, hold=held),
            Signal("place", "mm", -100.0, 100.0, hold=held),
        )
        self.outputs = (Signal("force", "kN", -1.0, 1.0),)
        self._u = np.zeros(2)

    def begin(self, held_input: FloatArray) -> None:
        """Take the first input."""
        self._u = np.array(held_input)

    def output(self) -> FloatArray:
        """Give the force."""
        return np.array([1e-3 * self._sign * STIFFNESS * (self._u[0] - 1e-3 * self._u[1])])

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Take the next input."""
        self._u = np.array(inputs)
        return self.output()


class Oscillator(Stepping):
    """A mass on a spring, which a force moves: a displacement comes out."""

    def __init__(self, step: float) -> None:
        """Take the step."""
        self.step = step
        self.inputs = (Signal("push", "N", -100.0, 100.0),)
        self.outputs = (Signal("place", "m", -0.1, 0.1),)
        self._x = np.zeros(2)

    def begin(self, held_input: FloatArray) -> None:
        """Begin at rest."""
        self._x = np.array([held_input[0] / STIFFNESS, 0.0])

    def output(self) -> FloatArray:
        """Give the displacement."""
        return self._x[:1].copy()

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Turn about the place of rest under a force that is held."""
        turn, rest = np.sqrt(STIFFNESS / MASS), inputs[0] / STIFFNESS
        c, s = np.cos(turn * self.step), np.sin(turn * self.step)
        away = self._x[0] - rest
        self._x = np.array(
            [rest + c * away + s * self._x[1] / turn, -s * turn * away + c * self._x[1]]
        )
        return self.output()


class Whole(System):
    """A spring that only simulates whole motions."""

    def __init__(self, step: float) -> None:
        """Take the step."""
        spring = Spring(step)
        self.step, self.inputs, self.outputs = step, spring.inputs, spring.outputs

    def simulate(self, inputs: FloatArray) -> FloatArray:
        """Simulate the spring."""
        return Spring(self.step).simulate(inputs)
