"""A gain with an offset, as slave of PythonFMU: y = 1 + u / 2, at once, or with a square."""

import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Gain(Fmi2Slave):
    """Its output follows its input at the same time."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.1)
        self.u, self.gain, self.square = 0.0, 0.5, 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        for name in ("gain", "square"):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
            )
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=self.value))

    def value(self):
        """Give the output."""
        return 1 + self.gain * self.u + self.square * self.u**2

    def do_step(self, current_time, step_size):
        """There is nothing to do."""
        return True
