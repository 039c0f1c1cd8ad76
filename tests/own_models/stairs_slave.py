"""Stairs as slave of PythonFMU: a discrete output that counts the steps, as a controller would."""

import sys

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Stairs(Fmi2Slave):
    """Its output is the number of steps that were taken."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.count = 0.0
        self.register_variable(
            Real("count", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete)
        )

    def do_step(self, current_time, step_size):
        """Climb one stair."""
        self.count += 1.0
        return True
