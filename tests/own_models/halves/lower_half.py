"""Lower half of a quarter car as slave of PythonFMU: wheel, tyre, hardening spring and damper.

Its inputs move along straight lines, which reach the values that are set by the end of a step. It
also gives the work that it has done on the body, which shows what a coupling adds.
"""

import math
import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Real

WHEEL, TYRE, TYRE_DAMPER, SPRING, HARDENING, DAMPER = 40.0, 2e5, 150.0, 2e4, 4e6, 1500.0
LONGEST, FARTHEST = 1e-3, 10.0


def force_on_body(x, body, rate):
    """Give the force of spring and damper in N."""
    travel, speed = x[0] - body, x[1] - rate
    return SPRING * travel + HARDENING * travel**3 + DAMPER * 0.5 * math.tanh(speed / 0.5)


def rates(x, road, road_rate, body, body_rate):
    """Give the rates of height and speed of the wheel, of the work, and of its size."""
    force = force_on_body(x, body, body_rate)
    tyre = TYRE * (road - x[0]) + TYRE_DAMPER * (road_rate - x[1])
    power = force * body_rate
    return x[1], (tyre - force) / WHEEL, power, abs(power)


class LowerHalf(Fmi2Slave):
    """It takes steps of at most 1 ms by the method of Runge and Kutta of order 4."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.01)
        self.road = self.body = 0.0
        self.before = [0.0, 0.0, 0.0, 0.0]
        self.x = [0.0, 0.0, 0.0, 0.0]
        for name in ("road", "body"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        given = {"force": self.force, "work": lambda: self.x[2], "exchanged": lambda: self.x[3]}
        for name, getter in given.items():
            self.register_variable(Real(name, causality=Fmi2Causality.output, getter=getter))

    def force(self):
        """Give the force on the body in N, at the end of a step."""
        return force_on_body(self.x, self.before[1], self.before[3])

    def exit_initialization_mode(self):
        """Both inputs were at rest before."""
        self.before = [self.road, self.body, 0.0, 0.0]
        self.x[0] = self.road

    def do_step(self, current_time, step_size):
        """Go along straight lines of the inputs; what is far away is no car any more."""
        if not abs(self.body) < FARTHEST:
            return False
        road, body = self.before[:2]
        road_rate, body_rate = (self.road - road) / step_size, (self.body - body) / step_size
        count = math.ceil(step_size / LONGEST - 1e-9)
        h, x = step_size / count, self.x
        for k in range(count):
            at = [k * h, (k + 0.5) * h, (k + 1) * h]
            u = [(road + t * road_rate, road_rate, body + t * body_rate, body_rate) for t in at]
            k1 = rates(x, *u[0])
            k2 = rates([a + 0.5 * h * b for a, b in zip(x, k1, strict=True)], *u[1])
            k3 = rates([a + 0.5 * h * b for a, b in zip(x, k2, strict=True)], *u[1])
            k4 = rates([a + h * b for a, b in zip(x, k3, strict=True)], *u[2])
            x = [
                a + h / 6 * (p + 2 * q + 2 * r + s)
                for a, p, q, r, s in zip(x, k1, k2, k3, k4, strict=True)
            ]
        self.x, self.before = x, [self.road, self.body, road_rate, body_rate]
        return True

    def _get_fmu_state(self):
        return {"x": list(self.x), "before": list(self.before), "u": [self.road, self.body]}

    def _set_fmu_state(self, state):
        self.x, self.before = list(state["x"]), list(state["before"])
        self.road, self.body = state["u"]
