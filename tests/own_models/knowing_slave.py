"""A slave of PythonFMU that repeats its input, and says of itself what a test wants to hear.

Its bound is 0.1. It is trusted while its input is not negative, and its bound is filled from
t = 1 s on, at communication steps of at least 0.1 s alone.
"""

import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Knowing(Fmi2Slave):
    """Its output at the end of a step is the input that was set before, whatever time it is of."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.1)
        self.u, self.y, self.y_error_bound, self.trusted = 0.0, 0.0, 0.1, 1.0
        self.error_bound_filled = self.inputs_at_step_end = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        for name in ("y", "y_error_bound", "trusted", "error_bound_filled"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        told = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("inputs_at_step_end", **told))

    def do_step(self, current_time, step_size):
        """Take the input over."""
        self.y, self.trusted = self.u, float(self.u >= 0)
        ends = current_time + step_size
        self.error_bound_filled = min(1.0, ends + 1e-9) if step_size > 0.099 else 0.0
        return True
