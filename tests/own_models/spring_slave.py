"""A spring as slave of PythonFMU: its force follows its inputs at once, or in each step."""

import sys

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Spring(Fmi2Slave):
    """With ``late`` = 1 its force is computed in ``do_step``, as many slaves do it."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        # the library of PythonFMU 0.7 releases the names of a module once too often
        vars(sys).setdefault("_spare_names", []).append(globals())
        self.default_experiment = DefaultExperiment(0.0, 1.0, 0.005)
        self.stiffness, self.middle, self.late = 100.0, 0.0, 0.0
        self.x, self.push, self.force = 0.0, 0.0, -1.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for name in ("stiffness", "middle", "late"):
            self.register_variable(Real(name, **fixed))
        for name in ("x", "push"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("force", causality=Fmi2Causality.output, getter=self.given))

    def law(self):
        """Give the force of the inputs."""
        return self.push - self.stiffness * (self.x - self.middle)

    def given(self):
        """Give the output."""
        return self.force if self.late else self.law()

    def do_step(self, current_time, step_size):
        """Compute the force."""
        self.force = self.law()
        return True

    def _get_fmu_state(self):
        parameters = [self.stiffness, self.middle, self.late]
        return {"values": [*parameters, self.x, self.push, self.force]}

    def _set_fmu_state(self, state):
        self.stiffness, self.middle, self.late, self.x, self.push, self.force = state["values"]
