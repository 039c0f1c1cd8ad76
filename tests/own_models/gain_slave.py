"""A gain with an offset, as slave of PythonFMU: y = 1 + u / 2, at once."""

import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Real


class Gain(Fmi2Slave):
    """Its output follows its input at the same time."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.1)
        self.u = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        output = Fmi2Causality.output
        self.register_variable(Real("y", causality=output, getter=lambda: 1 + 0.5 * self.u))

    def do_step(self, current_time, step_size):
        """There is nothing to do."""
        return True
