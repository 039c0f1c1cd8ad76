"""A mass under a force as slave of PythonFMU that keeps part of its state to itself, or fails."""

import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Faulty(Fmi2Slave):
    """PythonFMU saves the variables that are registered: the speed is none of them.

    It fails at the time ``end``.
    """

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.1)
        self.force, self.x, self.speed, self.end = 0.0, 0.01, 0.0, 1e9
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("end", **fixed))
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        """Integrate over a step."""
        if current_time > self.end:
            raise RuntimeError("the rope is torn")
        self.x += step_size * (self.speed + 0.5 * step_size * self.force)
        self.speed += step_size * self.force
        return True
