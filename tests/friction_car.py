"""A quarter car with smooth friction beside its damper, and a recipe for it that leaves all open.

Friction is a nonlinearity that matters most where velocities are small: the best linear model of
the car misses about a tenth of its suspension travel, and a few units gain little over it.
"""

from __future__ import annotations

import math
import tomllib
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Linearizable, Linearization, RandomStates, State
from slide_fmu.systems.errors import SimulationError
from tests.recipes import merged, whole_recipe

BODY, WHEEL = 300.0, 40.0
"""Masses in kg."""
SPRING, DAMPER, TYRE = 20e3, 1e3, 200e3
"""Stiffness in N/m, damping in N s/m, stiffness in N/m."""
FRICTION, SLIP = 150.0, 0.02
"""The friction FRICTION tanh(v / SLIP) in N is near its limit at velocities v beyond SLIP m/s."""
SUBSTEPS = 8
"""Runge-Kutta steps of fourth order per sample: the fastest rate is 250 1/s, 900 1/s with a slip
of 5 mm/s."""

Values = tuple[float, float, float, float]


class FrictionCar(RandomStates, Linearizable):
    """Road height in, a first-order hold; acceleration, travel and tyre deflection out."""

    def __init__(
        self,
        *,
        step: float = 0.01,
        friction: float = FRICTION,
        slip: float = SLIP,
        road: float = 0.05,
    ) -> None:
        self.step, self._friction, self._slip = step, friction, slip
        self.inputs = (Signal("road", "m", -road, road, "height", hold="first_order"),)
        self.outputs = (
            Signal("body_acceleration", "m/s2", -20.0, 20.0),
            Signal("suspension_travel", "m", -0.15, 0.15),
            Signal("tyre_deflection", "m", -0.05, 0.05),
        )
        self._state: Values = (0.0, 0.0, 0.0, 0.0)
        self._road = 0.0

    def _rates(self, state: Values, road: float) -> Values:
        """Time derivatives of the positions and velocities of body and wheel."""
        body, wheel, v_body, v_wheel = state
        slip = v_wheel - v_body
        force = SPRING * (wheel - body) + DAMPER * slip
        force += self._friction * math.tanh(slip / self._slip)
        return v_body, v_wheel, force / BODY, (TYRE * (road - wheel) - force) / WHEEL

    def advance(self, inputs: FloatArray) -> FloatArray:
        (target,), h = inputs.tolist(), self.step / SUBSTEPS
        rise = (target - self._road) / SUBSTEPS
        for index in range(SUBSTEPS):
            begin = self._road + index * rise
            one = self._rates(self._state, begin)
            two = self._rates(_moved(self._state, one, h / 2), begin + rise / 2)
            three = self._rates(_moved(self._state, two, h / 2), begin + rise / 2)
            four = self._rates(_moved(self._state, three, h), begin + rise)
            pairs = zip(one, two, three, four, strict=True)
            mean: Any = tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in pairs)
            self._state = _moved(self._state, mean, h)
        self._road = target
        if not all(map(math.isfinite, self._state)):
            raise SimulationError(f"the car diverged under a road height of {target} m")
        return self.output()

    def output(self) -> FloatArray:
        body, wheel, *_ = self._state
        acceleration = self._rates(self._state, self._road)[2]
        return np.array([acceleration, wheel - body, self._road - wheel])

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        road = 0.0 if first_input is None else float(first_input[0])
        positions = road + rng.uniform(-1, 1, 2) * (0.02, 0.005)
        return State(positions, rng.uniform(-0.2, 0.2, 2), np.array([road]))

    def rest_state(self, held_input: FloatArray) -> State:
        return State(np.repeat(held_input, 2), np.zeros(2), held_input)

    def set_state(self, state: State) -> None:
        body, wheel, v_body, v_wheel = (*state.coordinates, *state.velocities)
        self._state = float(body), float(wheel), float(v_body), float(v_wheel)
        self._road = float(state.last_input[0])

    def get_state(self) -> State:
        values = np.array(self._state)
        return State(values[:2], values[2:], np.array([self._road]))

    def linearize(self, state: State) -> Linearization:
        slip = float(state.velocities[1] - state.velocities[0])
        damping = DAMPER + self._friction / self._slip / math.cosh(slip / self._slip) ** 2
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness = SPRING * between + np.diag([0.0, TYRE])
        return Linearization(
            np.diag([BODY, WHEEL]), damping * between, stiffness, np.zeros((0, 2))
        )


def _moved(state: Values, rates: Values, time: float) -> Values:
    a, b, c, d = (x + time * rate for x, rate in zip(state, rates, strict=True))
    return a, b, c, d


RECIPE = """
name = "friction_car"
description = "Quarter car with smooth friction over a road of up to 50 mm"

[system]
model = "tests.friction_car:FrictionCar"

[window]
step = 0.01
n_in = 400
n_out = 64
remaining_amplitude = 0.01

[data]
seed = 1
duration = 10.0
burn_in = 4.0
train = 24
validation = 8

[[data.excitation]]
kind = "multisine"
weight = 0.5
amplitude = [0.05, 0.35]
angular_frequency = [1.0, 80.0]

[[data.excitation]]
kind = "sweep"
weight = 0.2
amplitude = [0.05, 0.6]
angular_frequency = [1.0, 80.0]

[[data.excitation]]
kind = "steps"
weight = 0.15
amplitude = [0.1, 0.8]
duration = [0.3, 2.0]

[[data.excitation]]
kind = "held_random"
weight = 0.15
amplitude = [0.05, 0.3]
samples = [5, 40]
"""


def friction_recipe(**changes: Any) -> Recipe:
    """The recipe of the car; tables given as keyword arguments are merged into it."""
    return whole_recipe(merged(tomllib.loads(RECIPE), changes))
