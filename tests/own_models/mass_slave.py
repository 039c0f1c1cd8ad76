"""A mass under a force that is held over each step, integrated exactly, as slave of PythonFMU."""

import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Mass(Fmi2Slave):
    """It begins at ``start``, 10 mm from rest."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.1)
        self.mass, self.start, self.force, self.x, self.v = 1.0, 0.01, 0.0, 0.0, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for name in ("mass", "start"):
            self.register_variable(Real(name, **fixed))
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        place = Real("x", causality=Fmi2Causality.output, getter=lambda: self.start + self.x)
        self.register_variable(place)
        self.register_variable(Real("v", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        """Integrate over a step."""
        rate = self.force / self.mass
        self.x += step_size * (self.v + 0.5 * step_size * rate)
        self.v += step_size * rate
        return True

    def _get_fmu_state(self):
        return {"values": [self.mass, self.start, self.force, self.x, self.v]}

    def _set_fmu_state(self, state):
        self.mass, self.start, self.force, self.x, self.v = state["values"]
