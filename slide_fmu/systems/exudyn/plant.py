"""Every call of an exudyn solver is here: from sample to sample, at rest, to linearize at a state.

A plant is an assembled exudyn system and its current state. Each sample step integrates from
t = 0 to t = h, so that a motion does not depend on how many samples went before, and forces may
use the time within the step (a first-order hold does).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import exudyn as exu
import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearization
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.user_code import error_text

Integrator = Literal["explicit", "generalized_alpha", "trapezoidal"]
"""How a plant is integrated, with fixed substeps.

``explicit``: the explicit Runge-Kutta method of order six (exudyn's ``RK67``), for systems without
constraints that are not stiff: at the accuracy wanted here it needs a third of the force
evaluations of the classical one of order four. ``generalized_alpha``: the generalized-alpha method
(Chung and Hulbert, 1993) with constraints on positions (index 3); it damps frequencies that it
cannot resolve. ``trapezoidal``: the trapezoidal rule with constraints on velocities (index 2): it
damps nothing, and the constraints on positions drift with time.
"""

INTEGRATOR_NAMES: dict[Integrator, str] = {
    "explicit": "RK67",
    "generalized_alpha": "generalized-alpha",
    "trapezoidal": "trapezoidal rule",
}
"""What people call them."""

_SPECTRAL_RADIUS = 0.9
"""Spectral radius of the generalized-alpha method at infinite frequency."""
_SMALLEST_SUBSTEP = 1.0 / 64.0
"""exudyn may reduce a substep to this part of it where Newton's method fails."""
_RELATIVE_TOLERANCE, _ABSOLUTE_TOLERANCE = 1e-7, 1e-6
"""Newton's residual must fall below one of these, the first relative to the first residual of the
step, which has weights in it: with 1e-4, the damping of a pendulum is wrong by 7 % where it moves
by a thousandth of what its weight could move. The second one is larger where a model is so stiff
that its forces are rounded more coarsely (``Plant.rounding``)."""
_STATIC_TOLERANCE = 1e-10
"""The same in searches for a state at rest, which is computed once: as exudyn has it."""
_REFERENCE = exu.ConfigurationType.Reference
_INITIAL = exu.ConfigurationType.Initial
_CURRENT = exu.ConfigurationType.Current
_DIFFERENCE = 1e-6
"""Linearizations move coordinates by this, and by this part of themselves."""
_REMEDY = "Use more substeps, a shorter step, or inputs within the range of the system"
_ROUNDING = float(np.finfo(np.float64).eps)
"""Forces of springs are rounded to this part of stiffness times coordinates."""


class Plant:
    """A plant is an exudyn system that is integrated with fixed substeps.

    The coordinates are exudyn's second-order ones q, counted from the reference configuration,
    then its first-order ones, then its data coordinates (of friction and contact); the velocities
    are q' and zeros for the others.

    Newton's method of the implicit integrators is modified: it keeps its Jacobian within a sample
    step while it converges. Where it does not converge, substeps are divided, down to one 64th.

    One solver run goes on from sample to sample, with its accelerations; after ``set_state`` they
    are computed from the equations of motion. So a motion is the same, bit by bit, whenever it
    starts from the same state, and one that is interrupted by ``set_state`` goes on to the
    accuracy of the integration.

    Attributes:
        mbs: the exudyn system; change loads and parameters there between two steps.
        step, substeps: sample step h in s, and integration steps in it.
        integrator: how it is integrated.
        continuous: whether forces are continuous in time from sample to sample; if not, every step
            of an implicit integrator begins with accelerations of its own.
        before_substep: is called with a time in s since the last sample, before the substep of an
            implicit integrator that ends at it, and with 0 before initial accelerations and
            linearizations. What depends on time is set there, and on nothing else, since divided
            substeps go back in time.
        has_kinks: whether forces may have kinks, as a damper at rest, or loads may depend on the
            state; exudyn's own differences, which are faster, go to one side and leave out loads.
        visible: whether sensors see the current state.
        origin: the coordinates of the initial configuration in SI units, shape (n,).
        rounding: what is left of balanced forces by rounding, in N or N m: no solver can go
            below it. A beam of steel, 10 cm thick, has 1e-5 N.
    """

    def __init__(
        self,
        container: exu.SystemContainer,
        mbs: exu.MainSystem,
        step: float,
        substeps: int,
        integrator: Integrator,
        accelerations: bool = False,
    ) -> None:
        """Take over an assembled system, at its initial configuration.

        The container is kept, since the system ends with it. ``accelerations`` says whether
        sensors see accelerations at the end of an explicit step.
        """
        self.mbs: Any = mbs
        self.step, self.substeps, self.integrator = step, substeps, integrator
        self.continuous, self.has_kinks = True, False
        self.before_substep: Callable[[float], None] = lambda time: None
        self._container = container
        explicit = integrator == "explicit"
        self._settings = _settings_of(step, substeps, integrator)
        self._settings.timeIntegration.explicit.computeEndOfStepAccelerations = accelerations
        # the implicit solver computes initial accelerations for both
        self._starter: Any = exu.MainSolverImplicitSecondOrder()
        self._solver: Any = exu.MainSolverExplicit() if explicit else self._starter
        self._size = mbs.systemData.ODE2Size()
        self._coordinates, self._velocities = self._found(_INITIAL)
        self.origin = self._coordinates
        self._running = self.visible = False
        if not explicit:
            mbs.SetPreStepUserFunction(self._prepare_substep)
        self._carried, self.rounding = self._initial_forces()
        newton = self._settings.timeIntegration.newton
        newton.absoluteTolerance = max(_ABSOLUTE_TOLERANCE, self.rounding)

    def set_state(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Continue from coordinates and velocities, shape (n,) each, in SI units."""
        self._coordinates, self._velocities = coordinates.copy(), velocities.copy()
        self._running = self.visible = False

    def coordinates(self) -> FloatArray:
        """Return the current coordinates in SI units, shape (n,)."""
        return self._coordinates.copy()

    def velocities(self) -> FloatArray:
        """Return the current velocities in SI units, shape (n,)."""
        return self._velocities.copy()

    def advance(self) -> None:
        """Go on by one sample step.

        Raises:
            SimulationError: exudyn or a user function failed, or the motion left the finite
                numbers; the state is still the one before.
        """
        # a run that fails is not running: the next step starts anew from the state before
        was_running = self._running and (self.continuous or self._solver is not self._starter)
        self._running = self.visible = False
        if was_running:  # it goes on from t = 0
            self._solver.it.currentTime = 0.0
            self.mbs.systemData.SetTime(0.0, _CURRENT)
        else:
            self._start(self._solver)
        self._call("stopped within one sample step", self._solver.SolveSteps, self._solver)
        self._coordinates, self._velocities = self._reached()
        self._running = self.visible = True

    def after_step(
        self, coordinates: FloatArray, velocities: FloatArray, begin: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the state after one sample step that begins at a time in s, (n,) each.

        Coordinates and velocities are in SI units, (n,) each. Sensors see the state that was
        reached; the plant's own one stays as it is.

        Raises:
            SimulationError: as of ``advance``.
        """
        self._running = self.visible = False
        settings = _settings_of(self.step, self.substeps, self.integrator)
        settings.timeIntegration.startTime = begin
        settings.timeIntegration.endTime = begin + self.step
        newton = self._settings.timeIntegration.newton
        settings.timeIntegration.newton.absoluteTolerance = newton.absoluteTolerance
        self._to_initial(coordinates, velocities)
        self._call("did not start", self._solver.InitializeSolver, self._solver, settings=settings)
        self._call("stopped", self._solver.SolveSteps, self._solver, settings=settings)
        return self._reached()

    def show(self) -> None:
        """Let sensors see the current state, with accelerations that follow from its forces.

        Raises:
            SimulationError: exudyn or a user function failed.
        """
        self._running = False
        self._start(self._starter)
        self.visible = True

    def static(self, coordinates: FloatArray) -> FloatArray:
        """Return what exudyn's static solver finds from coordinates, both in SI units, (n,).

        The current state stays as it is.

        Raises:
            SimulationError: it finds nothing, or a user function failed.
        """
        self._running = self.visible = False
        self._to_initial(coordinates, np.zeros(len(coordinates)))
        newton = self._settings.staticSolver.newton
        newton.absoluteTolerance = max(_STATIC_TOLERANCE, self.rounding)
        solver: Any = exu.MainSolverStatic()
        self._call("found no static equilibrium", solver.SolveSystem, solver, "")
        return self._reached()[0]

    def fallen(self, coordinates: FloatArray, time: float) -> FloatArray:
        """Return where the model is a time after it is let go at rest, by an implicit Euler step.

        The method takes the forces at the end of the time in s, so a long one leads to where they
        balance. Coordinates are in SI units, (n,); the current state stays as it is.

        Raises:
            SimulationError: Newton's method did not converge, or a user function failed.
        """
        self._running = self.visible = False
        settings = _settings_of(time, 1, "trapezoidal")
        integration = settings.timeIntegration
        integration.adaptiveStep = False
        # from rest, Newmark's method with these is the implicit Euler method
        method = integration.generalizedAlpha
        method.newmarkBeta, method.newmarkGamma, method.useIndex2Constraints = 0.5, 1.0, False
        integration.newton.useModifiedNewton = False
        integration.newton.absoluteTolerance = max(_STATIC_TOLERANCE, self.rounding)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        self._to_initial(coordinates, np.zeros(len(coordinates)))
        self._call("did not start", solver.InitializeSolver, solver, settings=settings)
        self._call("stopped", solver.SolveSteps, solver, settings=settings)
        return self._reached()[0]

    def balance(self, coordinates: FloatArray) -> tuple[Linearization, FloatArray]:
        """Return the linearization at rest at coordinates, (n,) in SI units, and the forces there.

        The forces, (n,), are all but those of constraints. The current state stays as it is.

        Raises:
            SimulationError: a user function failed, or a coordinate has no mass.
        """
        return self._linearized(coordinates, np.zeros(len(coordinates)), forces_too=True)

    def linearize(self, coordinates: FloatArray, velocities: FloatArray) -> Linearization:
        """Linearize at a state in SI units, shape (n,) each; the current state stays as it is.

        Time-dependent parameters are those that ``before_substep(0.0)`` sets. Data coordinates and
        first-order ones have no part in it. Constraints carry weights and other forces, which turn
        with the model: at rest those of the state, in a motion those of the initial configuration
        before inputs act, since what they carry besides goes with accelerations, which no
        linearization has.
        """
        return self._linearized(coordinates, velocities)[0]

    def _linearized(
        self, coordinates: FloatArray, velocities: FloatArray, forces_too: bool = False
    ) -> tuple[Linearization, FloatArray]:
        """Return the linearization at a state, and the forces at rest there, as of ``balance``.

        Without ``forces_too`` the forces may be missing.
        """
        data, size = self.mbs.systemData, self._size
        kept, time = data.GetSystemState(_CURRENT), data.GetTime(_CURRENT)
        accelerations = data.GetODE2Coordinates_tt(_CURRENT)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        self._to_initial(coordinates, velocities)
        mass, stiffness, damping, constraints = self._matrices()
        at_rest, forces = not np.any(velocities), np.zeros(size)
        if self.has_kinks or constraints.size or forces_too:
            self._call("did not start", solver.InitializeSolver, solver)
            if at_rest:
                forces = self._applied(solver)
        if self.has_kinks:
            applied = partial(self._applied, solver)
            stiffness = self._slopes(applied, coordinates, data.SetODE2Coordinates)
            damping = self._slopes(applied, velocities, data.SetODE2Coordinates_t)
        if constraints.size:
            carried = _carried(mass, constraints, forces) if at_rest else self._carried
            held = partial(self._held, solver, carried)
            stiffness = stiffness + self._slopes(held, coordinates, data.SetODE2Coordinates)
        data.SetSystemState(kept, _CURRENT)
        data.SetODE2Coordinates_tt(accelerations, _CURRENT)
        data.SetTime(time, _CURRENT)
        return Linearization(mass, damping, stiffness, constraints), forces

    def _matrices(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return exudyn's mass, stiffness, damping (n, n) and constraints (n_constraints, n)."""
        mass, stiffness, damping, *rest = self.mbs.ComputeLinearizedSystem(
            returnConstraintJacobian=True
        )
        transposed = rest[0] if rest else []  # a system without constraints gives none
        constraints = np.array(transposed, dtype=np.float64).reshape(self._size, -1).T
        return mass, stiffness, damping, constraints

    def _initial_forces(self) -> tuple[FloatArray, float]:
        """Return what constraints carry in the initial configuration, and the rounding of forces.

        The first are the multipliers by which they carry weights before inputs act,
        (n_constraints,); the second is as of ``rounding``.
        """
        data, size = self.mbs.systemData, self._size
        places = np.abs(data.GetODE2Coordinates(_REFERENCE) + self.origin[:size])
        try:
            linearization, forces = self.balance(self.origin)
        except Exception:  # of a user's function: the first step tells of it
            return np.zeros(data.AEsize()), 0.0
        mass, constraints = linearization.mass, linearization.constraints
        rounded = _ROUNDING * (np.abs(linearization.stiffness) @ places)
        rounding = float(np.max(rounded[np.isfinite(rounded)], initial=0.0))
        return _carried(mass, constraints, forces), rounding

    def _applied(self, solver: Any) -> FloatArray:
        """Return all forces but those of constraints, (n,)."""
        solver.ComputeODE2RHS(self.mbs)
        return np.array(solver.GetSystemResidual()[: self._size])

    def _held(self, solver: Any, multipliers: FloatArray) -> FloatArray:
        """Return forces of constraints, (n,): since these turn with the motion, they are stiff."""
        solver.SetSystemJacobian(np.zeros_like(solver.GetSystemJacobian()))
        solver.ComputeJacobianAE(self.mbs)
        jacobian: FloatArray = np.array(solver.GetSystemJacobian())
        return -jacobian[: self._size, -len(multipliers) :] @ multipliers

    def _slopes(
        self, forces: Callable[[], FloatArray], values: FloatArray, set_to: Callable[..., None]
    ) -> FloatArray:
        """Return by how much forces fall with what ``set_to`` sets, by central differences."""
        columns = []
        for index, reach in enumerate(_DIFFERENCE * (1.0 + np.abs(values[: self._size]))):
            pair = []
            for sign in (1.0, -1.0):
                moved = values[: self._size].copy()
                moved[index] += sign * reach
                set_to(moved, _CURRENT)
                pair.append(forces())
            columns.append((pair[1] - pair[0]) / (2.0 * reach))
        set_to(values[: self._size], _CURRENT)
        return np.array(columns).T

    def _start(self, solver: Any) -> None:
        """Begin a solver run at the current state; an implicit solver computes accelerations."""
        self._to_initial(self._coordinates, self._velocities)
        self._call("did not start", solver.InitializeSolver, solver)

    def _call(
        self,
        failure: str,
        method: Callable[..., bool],
        solver: Any,
        remedy: str = f". {_REMEDY}",
        settings: exu.SimulationSettings | None = None,
    ) -> None:
        """Call a method of a solver; if it fails, the message has the failure and the remedy."""
        try:
            fine = method(self.mbs, settings or self._settings)
            complaint = repr(solver.GetErrorString())
        except Exception as error:  # a user function of the system may raise anything
            if (interrupt := _interrupt_behind(error)) is not None:  # Ctrl-C within a step
                raise interrupt from None
            fine, complaint = False, raised_in_exudyn(error)
        if not fine:
            raise SimulationError(f"exudyn {failure}: {complaint}{remedy}")

    def _to_initial(self, coordinates: FloatArray, velocities: FloatArray) -> None:
        """Make a state exudyn's initial one, with the parameters of the start of a step."""
        data, size = self.mbs.systemData, self._size
        data.SetODE2Coordinates(coordinates[:size], _INITIAL)
        data.SetODE2Coordinates_t(velocities[:size], _INITIAL)
        if len(coordinates) > size:
            first = size + data.ODE1Size()
            data.SetODE1Coordinates(coordinates[size:first], _INITIAL)
            data.SetDataCoordinates(coordinates[first:], _INITIAL)
        self.before_substep(0.0)

    def _prepare_substep(self, mbs: Any, time: float) -> bool:
        """Answer exudyn, which calls this before a substep with the time at its end."""
        self.before_substep(time)
        return True

    def _found(self, where: exu.ConfigurationType) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and velocities of a configuration of exudyn."""
        data = self.mbs.systemData
        coordinates, velocities = data.GetODE2Coordinates(where), data.GetODE2Coordinates_t(where)
        others = data.ODE1Size() + data.DataSize()
        if others:
            parts = data.GetODE1Coordinates(where), data.GetDataCoordinates(where)
            coordinates = np.concatenate([coordinates, *parts])
            velocities = np.concatenate([velocities, np.zeros(others)])
        return coordinates, velocities

    def _reached(self) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and velocities at the end of a solver run, which must be finite."""
        coordinates, velocities = self._found(_CURRENT)
        if not (np.isfinite(coordinates).all() and np.isfinite(velocities).all()):
            raise SimulationError(
                f"the motion diverged within one sample step: q = {coordinates}, q' = "
                f"{velocities}; expected finite values. {_REMEDY}"
            )
        return coordinates, velocities


def _carried(mass: FloatArray, constraints: FloatArray, forces: FloatArray) -> FloatArray:
    """Return the multipliers by which constraints carry forces, (n_constraints,)."""
    none = np.zeros((len(constraints), len(constraints)))
    whole = np.block([[mass, constraints.T], [constraints, none]])
    right = np.concatenate([forces, np.zeros(len(constraints))])
    return np.asarray(np.linalg.lstsq(whole, right, rcond=None)[0][len(mass) :])


def _settings_of(step: float, substeps: int, integrator: Integrator) -> exu.SimulationSettings:
    """Return settings of a silent run over one sample step, without files, sensors, messages."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = step
    integration.numberOfSteps = substeps
    integration.automaticStepSize = False
    integration.verboseMode = settings.staticSolver.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    integration.solverType = exu.DynamicSolverType.RK67
    integration.adaptiveStep = integrator != "explicit"
    integration.minimumStepSize = _SMALLEST_SUBSTEP * step / substeps
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = _RELATIVE_TOLERANCE
    integration.newton.absoluteTolerance = _ABSOLUTE_TOLERANCE
    integration.generalizedAlpha.useNewmark = integrator == "trapezoidal"
    integration.generalizedAlpha.useIndex2Constraints = integrator == "trapezoidal"
    integration.generalizedAlpha.spectralRadius = _SPECTRAL_RADIUS
    # dense matrices are as fast as sparse ones up to about 100 coordinates
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    return settings


def raised_in_exudyn(error: BaseException) -> str:
    """Say what a user's code raised, and where; exudyn wraps what its user functions raise."""
    place = re.search(r"At:\s+(\S.*)\((\d+)\): ", str(error))
    if error.__cause__ is None or place is None:
        return error_text(error)
    return f"{error_text(error.__cause__)} ({place[1]}, line {place[2]})"


def _interrupt_behind(error: BaseException | None) -> KeyboardInterrupt | None:
    """Return the interrupt that led to an error, at any distance; None without one."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error
