"""A quarter car over a road as slave of PythonFMU, which reads this file alone."""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

BODY, WHEEL, SPRING, BUMP_STOP, DAMPER, ASYMMETRY, TYRE = 300, 40, 18e3, 4e6, 1800, 0.4, 180e3
BEND = 0.05


def forces(x, road):
    """Give the force of the suspension on the wheel and that of the tyre on it, in N."""
    travel, speed = x[0] - x[1], x[2] - x[3]
    bend = math.sqrt(speed * speed + BEND * BEND) - BEND
    force = SPRING * travel + BUMP_STOP * travel**3 + DAMPER * (speed + ASYMMETRY * bend)
    return force, TYRE * (road - x[1])


def rates(x, road):
    """Give the rates of the states: heights of body and wheel, and their speeds."""
    force, tyre = forces(x, road)
    return x[2], x[3], -force / BODY, (force + tyre) / WHEEL


class QuarterCar(Fmi2Slave):
    """A quarter car that takes steps of at most 0.5 ms, by the method of Runge and Kutta."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.road = 0.0
        self.x = None
        self.register_variable(Real("road", causality=Fmi2Causality.input))
        for name in ("body_acceleration", "suspension_travel", "tyre_deflection"):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        """The car stands on the road where it is."""
        self.x = [self.road, self.road, 0.0, 0.0]
        self.give()

    def do_step(self, current_time, step_size):
        """Take the steps; the road stays where it is."""
        count = math.ceil(step_size / 5e-4 - 1e-9)
        for _ in range(count):
            self.x = step(self.x, self.road, step_size / count)
        self.give()
        return True

    def give(self):
        """Set the outputs."""
        self.body_acceleration = -forces(self.x, self.road)[0] / BODY
        self.suspension_travel = self.x[0] - self.x[1]
        self.tyre_deflection = self.x[1] - self.road


def step(x, road, h):
    """Take one step of the method of Runge and Kutta."""
    k1 = rates(x, road)
    k2 = rates(along(x, k1, 0.5 * h), road)
    k3 = rates(along(x, k2, 0.5 * h), road)
    k4 = rates(along(x, k3, h), road)
    k = [a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
    return along(x, k, h / 6)


def along(x, rate, time):
    """Go from states along rates for a time."""
    return [a + time * b for a, b in zip(x, rate, strict=True)]
