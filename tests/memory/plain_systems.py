"""Systems that can be simulated, and nothing else: they forget, or they do not."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError


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


class WrongSign(Lag):
    """y' = y + u grows by itself, whatever the input."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        values = [0.0]
        for (value,) in inputs:
            values.append((values[-1] + float(value) * self.step) / (1.0 - self.step))
        return np.array(values)[:, None]


class Undamped(Lag):
    """A swinging mass without damping: it never comes to rest."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        turn = np.exp(1j * 3.0 * self.step)
        state, values = 0j, [0.0]
        for (value,) in inputs:
            state = value + (state - value) * turn
            values.append(state.real)
        return np.array(values)[:, None]


class Stepwise(Lag):
    """A system of differential equations under a held input, by the midpoint rule."""

    SUBSTEPS = 8
    START: tuple[float, ...] = (0.0, 0.0)

    def rates(self, state: list[float], value: float) -> list[float]:
        raise NotImplementedError

    def simulate(self, inputs: FloatArray) -> FloatArray:
        state, h = list(self.START), self.step / self.SUBSTEPS
        values = [state[0]]
        for value in inputs[:, 0].tolist():
            for _ in range(self.SUBSTEPS):
                now = self.rates(state, value)
                middle = [x + 0.5 * h * rate for x, rate in zip(state, now, strict=True)]
                then = self.rates(middle, value)
                state = [x + h * rate for x, rate in zip(state, then, strict=True)]
            values.append(state[0])
        return np.array(values)[:, None]


class Buckled(Stepwise):
    """A spring that snaps through: it rests at 1 m or at -1 m. Its unit of force is 200 N."""

    START = (1.0, 0.0)

    def rates(self, state: list[float], value: float) -> list[float]:
        x, v = state
        return [v, 200.0 * value - 100.0 * x * (x * x - 1.0) - 8.0 * v]


class BoucWen(Stepwise):
    """A mass on a spring and on a hysteretic joint of 2 N. Its unit of force is 5 N."""

    START = (0.0, 0.0, 0.0)

    def rates(self, state: list[float], value: float) -> list[float]:
        x, v, z = state
        slip = 1.0 - (abs(z) / 0.02 if v * z > 0 else 0.0)
        return [v, 5.0 * value - 50.0 * x - 50.0 * z - 4.0 * v, v * slip]


class Friction(Stepwise):
    """A mass of 1 kg on a spring, with a damper and smooth friction. Its unit of force is 20 N."""

    def rates(self, state: list[float], value: float) -> list[float]:
        x, v = state
        return [v, 20.0 * value - 100.0 * x - 2.0 * v - 2.0 * math.tanh(v / 0.05)]


class DeadZone(Stepwise):
    """A mass between two stops with a weak spring that centres it. Its unit of force is 20 N."""

    def rates(self, state: list[float], value: float) -> list[float]:
        x, v = state
        stop = max(x - 0.1, 0.0) + min(x + 0.1, 0.0)
        return [v, 20.0 * value - 10.0 * x - 400.0 * stop - 4.0 * v]


class Play(Lag):
    """Backlash of 0.2 in front of a lag: hysteresis without a differential equation."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        after, values = 0.0, [0.0]
        for (value,) in inputs:
            after = min(max(after, value - 0.2), value + 0.2)
            values.append(self.decay * values[-1] + (1.0 - self.decay) * after)
        return np.array(values)[:, None]


class TwoLags(Lag):
    """A fast lag, and a slow one that is a twentieth of the output."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        fast = super().simulate(inputs)
        slow = Lag(self.step, 15.0).simulate(inputs)
        return fast + 0.05 * slow


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


class Hardening(Lag):
    """It answers at once: by a force with a cube, and by the force alone. It bears no more force
    than a largest one, and is not made with a cube above another number."""

    def __init__(
        self, step: float = 0.05, cube: float = 0.0, most: float = math.inf, made: float = math.inf
    ) -> None:
        super().__init__(step)
        if cube > made:
            raise LoadError(f"cube = {cube:g}; expected at most {made:g}")
        self.outputs = tuple(Signal(name, "m", -1.0, 1.0) for name in ("hard", "soft"))
        self.cube, self.most = cube, most

    def simulate(self, inputs: FloatArray) -> FloatArray:
        if np.max(np.abs(inputs)) > self.most:
            raise SimulationError(f"the force is above {self.most:g} N")
        force = np.concatenate([inputs[:1], inputs])
        return np.concatenate([force + self.cube * force**3, force], axis=1)


class HighPass(Lag):
    """What a lag has not reached yet: it jumps with its input."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        return np.concatenate([inputs[:1], inputs]) - super().simulate(inputs)


class Threshold(Lag):
    """Nothing comes through below a level that the inputs seldom reach."""

    def __init__(self, step: float = 0.05, level: float = 2.0) -> None:
        super().__init__(step)
        self.level = level

    def simulate(self, inputs: FloatArray) -> FloatArray:
        return super().simulate(np.sign(inputs) * np.maximum(np.abs(inputs) - self.level, 0.0))


class FixedStep(Lag):
    """Can be made with one step alone, like an FMU whose step is fixed."""

    def __init__(self, step: float) -> None:
        if step != 0.01:
            raise ValueError(f"step = {step}; expected 0.01")
        super().__init__(step)


class Fragile(Lag):
    """A lag that fails where the force is above a level; it counts how often it did."""

    def __init__(self, step: float = 0.05, level: float = 0.99) -> None:
        super().__init__(step)
        self.level, self.failed = level, 0

    def simulate(self, inputs: FloatArray) -> FloatArray:
        if np.max(inputs) > self.level:
            self.failed += 1
            time = self.step * float(np.argmax(inputs > self.level))
            raise SimulationError(f"the force is above {self.level:g} N", time)
        return super().simulate(inputs)
