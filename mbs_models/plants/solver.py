"""Every call of an exudyn solver is here: from sample to sample, and to linearize at a state.

A plant is an assembled exudyn system and its current state. Each sample step integrates from
t = 0 to t = h, so that a motion does not depend on how many samples went before, and forces may
use the time within the step (a first-order hold does).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization, SimulationError

_INITIAL = exu.ConfigurationType.Initial
_CURRENT = exu.ConfigurationType.Current
_SMALLEST_SUBSTEP = 1.0 / 64.0
"""exudyn may reduce a substep to this part of it where Newton's method fails."""
_RELATIVE_TOLERANCE, _ABSOLUTE_TOLERANCE = 1e-4, 1e-6
"""Newton's residual must fall below these, the first relative to the first residual of the step.
If the second one were too small, rounding would keep Newton's method from reaching it at rest."""


class ExplicitPlant:
    """An explicit plant is an exudyn system without constraints, integrated with fixed substeps.

    The *initial* configuration of exudyn always holds the current state. The method is the
    explicit Runge-Kutta method of order six (exudyn ``RK67``): at the accuracy wanted here it
    needs a third of the force evaluations of the classical one of order four.

    Attributes:
        mbs: the exudyn system; change loads and parameters there between two steps.
    """

    def __init__(
        self, container: exu.SystemContainer, mbs: exu.MainSystem, step: float, substeps: int
    ) -> None:
        """Take over an assembled system; it ends with its container, which is therefore kept."""
        self.mbs: Any = mbs
        self._container = container
        self._solver: Any = exu.MainSolverExplicit()
        self._settings = _silent_settings(step, substeps)
        self._settings.timeIntegration.solverType = exu.DynamicSolverType.RK67
        self._settings.timeIntegration.explicit.computeEndOfStepAccelerations = False

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates q and velocities q', shape (n,) each, in SI units."""
        self.mbs.systemData.SetODE2Coordinates(coordinates, _INITIAL)
        self.mbs.systemData.SetODE2Coordinates_t(velocities, _INITIAL)

    def coordinates(self) -> FloatArray:
        """Return the current coordinates q in SI units, shape (n,)."""
        return np.array(self.mbs.systemData.GetODE2Coordinates(_INITIAL), dtype=np.float64)

    def velocities(self) -> FloatArray:
        """Return the current velocities q' in SI units, shape (n,)."""
        return np.array(self.mbs.systemData.GetODE2Coordinates_t(_INITIAL), dtype=np.float64)

    def advance(self) -> None:
        """Go on by one sample step.

        Raises:
            SimulationError: exudyn gave up, or the motion left the finite numbers.
        """
        if not self._solver.SolveSystem(self.mbs, self._settings):
            raise SimulationError(f"exudyn stopped: {self._solver.GetErrorString()}")
        self.set_state(*_reached(self.mbs))

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state in SI units, shape (n,) each; the current state stays as it is."""
        kept = self.coordinates(), self.velocities()
        self.set_state(coordinates, velocities)
        try:
            mass, stiffness, damping = self.mbs.ComputeLinearizedSystem()
        finally:
            self.set_state(*kept)
        return Linearization(mass, damping, stiffness, np.zeros((0, len(mass))))


class ImplicitPlant:
    """An implicit plant is an exudyn system with constraints, integrated with fixed substeps.

    Newton's method is modified: it keeps its Jacobian within a sample step while it converges.
    Where it does not converge, substeps are divided, down to one 64th.

    One solver run goes on from sample to sample, with its accelerations; after ``set_state`` they
    are computed from the equations of motion. So a motion is the same, bit by bit, whenever it
    starts from the same state, and one that is interrupted by ``set_state`` goes on to the
    accuracy of the integration. Forces must be continuous in time from sample to sample. Data
    coordinates (of friction, contact, counted turns) are left as they are.

    Attributes:
        mbs: the exudyn system; change loads and parameters there between two steps.
        before_substep: is called with a time in s since the last sample, before the substep that
            ends at it, and with 0 before initial accelerations and linearizations. What depends
            on time is set there, and on nothing else, since divided substeps go back in time.
    """

    def __init__(
        self,
        container: exu.SystemContainer,
        mbs: exu.MainSystem,
        step: float,
        substeps: int,
        spectral_radius: float | None = 0.9,
    ) -> None:
        """Take over an assembled system with its container, at rest where it was assembled.

        Args:
            container: the system's container.
            mbs: the system.
            step: sample step h in s.
            substeps: integration steps per sample step.
            spectral_radius: spectral radius at infinity, in [0, 1], of the generalized-alpha
                method (Chung and Hulbert, 1993) with constraints on positions (index 3); the
                smaller, the more it damps frequencies that it cannot resolve. None for the
                trapezoidal rule with constraints on velocities (index 2): it damps nothing, and
                the constraints on positions drift with time.
        """
        self.mbs: Any = mbs
        self.before_substep: Callable[[float], None] = lambda time: None
        self._container = container
        self._solver: Any = exu.MainSolverImplicitSecondOrder()
        self._settings = _implicit_settings(step, substeps, spectral_radius)
        size = mbs.systemData.ODE2Size()
        self.set_state(np.zeros(size), np.zeros(size))
        mbs.SetPreStepUserFunction(self._prepare_substep)

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates q and velocities q', shape (n,) each, in SI units.

        The coordinates count from the reference configuration, as everywhere in exudyn.
        """
        self._coordinates, self._velocities = coordinates.copy(), velocities.copy()
        self._running = False

    def coordinates(self) -> FloatArray:
        """Return the current coordinates q in SI units, shape (n,)."""
        return self._coordinates.copy()

    def velocities(self) -> FloatArray:
        """Return the current velocities q' in SI units, shape (n,)."""
        return self._velocities.copy()

    def advance(self) -> None:
        """Go on by one sample step.

        Raises:
            SimulationError: Newton's method failed, or the motion left the finite numbers; the
                state is still the one before.
        """
        # a run that fails is not running: the next step starts anew from the state before
        was_running, self._running = self._running, False
        if was_running:  # it goes on from t = 0
            self._solver.it.currentTime = 0.0
            self.mbs.systemData.SetTime(0.0, _CURRENT)
        else:
            self._start()
        if not self._solver.SolveSteps(self.mbs, self._settings):
            raise SimulationError(
                f"exudyn stopped within one sample step: {self._solver.GetErrorString()!r}. "
                "Use more substeps, a shorter step, or inputs within the range of the system"
            )
        self._coordinates, self._velocities = _reached(self.mbs)
        self._running = True

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state in SI units, shape (n,) each; the current state stays as it is.

        Time-dependent parameters are those that ``before_substep(0.0)`` sets.
        """
        kept = self.mbs.systemData.GetSystemState(_CURRENT)
        accelerations = self.mbs.systemData.GetODE2Coordinates_tt(_CURRENT)
        self._to_initial(coordinates, velocities)
        parts = self.mbs.ComputeLinearizedSystem(returnConstraintJacobian=True)
        self.mbs.systemData.SetSystemState(kept, _CURRENT)
        self.mbs.systemData.SetODE2Coordinates_tt(accelerations, _CURRENT)
        mass, stiffness, damping = parts[:3]
        transposed = parts[3] if len(parts) > 3 else []  # a system without constraints gives none
        constraints = np.array(transposed, dtype=np.float64).reshape(len(mass), -1).T
        return Linearization(mass, damping, stiffness, constraints)

    def _start(self) -> None:
        """Begin a solver run at the current state; the solver computes the accelerations."""
        self._to_initial(self._coordinates, self._velocities)
        if not self._solver.InitializeSolver(self.mbs, self._settings):
            raise SimulationError(f"exudyn did not start: {self._solver.GetErrorString()!r}")

    def _to_initial(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Make a state exudyn's initial one, with the parameters of the start of a step."""
        self.mbs.systemData.SetODE2Coordinates(coordinates, _INITIAL)
        self.mbs.systemData.SetODE2Coordinates_t(velocities, _INITIAL)
        self.before_substep(0.0)

    def _prepare_substep(self, mbs: Any, time: float) -> bool:
        """Answer exudyn, which calls this before a substep with the time at its end."""
        self.before_substep(time)
        return True


def _reached(mbs: Any) -> tuple[FloatArray, FloatArray]:
    """Return coordinates and velocities at the end of a solver run, which must be finite."""
    coordinates = mbs.systemData.GetODE2Coordinates()
    velocities = mbs.systemData.GetODE2Coordinates_t()
    if not (np.isfinite(coordinates).all() and np.isfinite(velocities).all()):
        raise SimulationError(
            f"the motion diverged within one sample step: q = {coordinates}, q' = {velocities}; "
            "expected finite values. Use more substeps, a shorter step, or inputs within the "
            "range of the system"
        )
    return coordinates, velocities


def _implicit_settings(
    step: float, substeps: int, spectral_radius: float | None
) -> exu.SimulationSettings:
    """Return settings of a silent implicit solver run over one sample step."""
    settings = _silent_settings(step, substeps)
    integration = settings.timeIntegration
    integration.adaptiveStep = True
    integration.minimumStepSize = _SMALLEST_SUBSTEP * step / substeps
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = _RELATIVE_TOLERANCE
    integration.newton.absoluteTolerance = _ABSOLUTE_TOLERANCE
    trapezoidal = spectral_radius is None
    integration.generalizedAlpha.useNewmark = trapezoidal
    integration.generalizedAlpha.useIndex2Constraints = trapezoidal
    if spectral_radius is not None:
        integration.generalizedAlpha.spectralRadius = spectral_radius
    # dense matrices are as fast as sparse ones up to about 100 coordinates
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    return settings


def _silent_settings(step: float, substeps: int) -> exu.SimulationSettings:
    """Return settings of a solver run over one sample step, without files, sensors, messages."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = step
    integration.numberOfSteps = substeps
    integration.automaticStepSize = False
    integration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    return settings
