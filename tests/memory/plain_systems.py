"""Systems that can be simulated, and nothing else: they forget, or they do not."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import System


class Lag(System):
    """y' = (u - y) / T, exactly; it forgets to 1 % in T ln(100)."""

    def __init__(self, step: float = 0.05, time_constant: float = 0.5) -> None:
        self.step, self.decay = step, math.exp(-step / time_constant)
        self.inputs = (Signal("force", "N", -1.0, 1.0),)
        self.outputs = (Signal("x", "m", -1.0, 1.0),)

    def simulate(self, inputs: FloatArray) -> FloatArray:
        values = [float(inputs[0, 0])]
        for (value,) in inputs:
            values.append(self.decay * values[-1] + (1.0 - self.decay) * float(value))
        return np.array(values)[:, None]


class Integrator(Lag):
    """y' = u never forgets."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        return np.concatenate([[[0.0]], self.step * np.cumsum(inputs, axis=0)])


class Acceleration(Lag):
    """Acceleration of a unit mass on a spring and a damper; it follows the force at once."""

    FREQUENCY, DAMPING = 40.0, 0.1

    def __init__(self, step: float = 0.01) -> None:
        super().__init__(step)
        w, d = self.FREQUENCY, self.DAMPING
        whole = np.zeros((3, 3))
        whole[:2] = [[0.0, 1.0, 0.0], [-w * w, -2.0 * d * w, 1.0]]
        self.spring, self.law = whole[1, :2], expm(whole * step)

    def simulate(self, inputs: FloatArray) -> FloatArray:
        state, values = np.zeros(2), [float(inputs[0, 0])]
        for (value,) in inputs:
            state = self.law[:2, :2] @ state + self.law[:2, 2] * value
            values.append(float(self.spring @ state + value))
        return np.array(values)[:, None]


class Through(Lag):
    """Has no dynamics at all."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        return np.concatenate([inputs[:1], inputs])


class FixedStep(Lag):
    """Can be made with one step alone, like an FMU whose step is fixed."""

    def __init__(self, step: float) -> None:
        if step != 0.01:
            raise ValueError(f"step = {step}; expected 0.01")
        super().__init__(step)
