"""Upper half of a quarter car as slave of PythonFMU: a body that a force moves, exactly.

The force is held over each step. It also gives the work that was done on the body.
"""

import sys

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class UpperHalf(Fmi2Slave):
    """A mass on which a force acts."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.mass, self.start = 300.0, 0.0
        self.force = self.position = self.speed = self.work = 0.0
        for name in ("mass", "start"):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
            )
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        for name in ("position", "speed", "work"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        """It is at rest where it starts."""
        self.position = self.start

    def do_step(self, current_time, step_size):
        """Move under a constant force."""
        acceleration = self.force / self.mass
        way = step_size * self.speed + 0.5 * step_size**2 * acceleration
        self.work += self.force * way
        self.position += way
        self.speed += step_size * acceleration
        return True

    def _get_fmu_state(self):
        return {"all": [self.force, self.position, self.speed, self.work]}

    def _set_fmu_state(self, state):
        self.force, self.position, self.speed, self.work = state["all"]
