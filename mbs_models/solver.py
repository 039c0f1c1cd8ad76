"""Every call of an exudyn solver: from sample to sample, and the linearization at a state.

A plant is an assembled exudyn system whose *initial* configuration always holds the current
state. Each sample step integrates from t = 0 to t = h, so that a motion does not depend on how
many samples went before, and forces may use the time within the step (a ramp does).
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np

from slide_fmu.signals import FloatArray
from slide_fmu.systems.base import Linearization, SimulationError

_INITIAL = exu.ConfigurationType.Initial


class ExplicitPlant:
    """An assembled exudyn system without constraints, integrated with fixed substeps.

    The method is the explicit Runge-Kutta method of order six (exudyn ``RK67``): at the accuracy
    wanted here it needs a third of the force evaluations of the classical one of order four.

    Attributes:
        mbs: the exudyn system; change loads and parameters there between two steps.
    """

    def __init__(
        self, container: exu.SystemContainer, mbs: exu.MainSystem, step: float, substeps: int
    ) -> None:
        """Take over an assembled system.

        Args:
            container: owner of ``mbs``; kept, because the system ends with it.
            mbs: the assembled system.
            step: sample step h in s.
            substeps: integration steps per sample step.
        """
        self.mbs: Any = mbs
        self._container = container
        self._solver: Any = exu.MainSolverExplicit()
        self._settings = _explicit_settings(step, substeps)

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates q and velocities q', shape (n,) each, in SI units."""
        self.mbs.systemData.SetODE2Coordinates(coordinates, _INITIAL)
        self.mbs.systemData.SetODE2Coordinates_t(velocities, _INITIAL)

    def coordinates(self) -> FloatArray:
        """Current coordinates q, shape (n,)."""
        return np.array(self.mbs.systemData.GetODE2Coordinates(_INITIAL), dtype=np.float64)

    def velocities(self) -> FloatArray:
        """Current velocities q', shape (n,)."""
        return np.array(self.mbs.systemData.GetODE2Coordinates_t(_INITIAL), dtype=np.float64)

    def advance(self) -> None:
        """Go on by one sample step.

        Raises:
            SimulationError: exudyn gave up, or the motion left the finite numbers.
        """
        if not self._solver.SolveSystem(self.mbs, self._settings):
            raise SimulationError(f"exudyn stopped: {self._solver.GetErrorString()}")
        data = self.mbs.systemData
        coordinates, velocities = data.GetODE2Coordinates(), data.GetODE2Coordinates_t()
        if not (np.isfinite(coordinates).all() and np.isfinite(velocities).all()):
            raise SimulationError(
                f"the motion diverged within one sample step: q = {coordinates}, "
                f"q' = {velocities}; expected finite values. Use more substeps, a shorter step, "
                "or inputs within the range of the system"
            )
        self.set_state(coordinates, velocities)

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state, shape (n,) each; the current state is left as it is."""
        kept = self.coordinates(), self.velocities()
        self.set_state(coordinates, velocities)
        try:
            mass, stiffness, damping = self.mbs.ComputeLinearizedSystem()
        finally:
            self.set_state(*kept)
        return Linearization(mass, damping, stiffness, np.zeros((0, len(mass))))


def _explicit_settings(step: float, substeps: int) -> exu.SimulationSettings:
    """Settings of a silent solver run over one sample step: no files, no sensors, no messages."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.solverType = exu.DynamicSolverType.RK67
    integration.endTime = step
    integration.numberOfSteps = substeps
    integration.automaticStepSize = False
    integration.explicit.computeEndOfStepAccelerations = False
    integration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    return settings
