"""How exudyn integrates over a sample step, and how silently."""

from __future__ import annotations

from typing import Literal

import exudyn as exu

Integrator = Literal["explicit", "generalized_alpha", "trapezoidal"]
"""How a plant is integrated, with fixed substeps.

``explicit``: the explicit Runge-Kutta method of order six (exudyn's ``RK67``), for systems without
constraints that are not stiff: at the accuracy wanted here it needs a third of the force
evaluations of the classical one of order four. ``generalized_alpha``: the generalized-alpha method
(Chung and Hulbert, 1993) with constraints on positions (index 3); it damps frequencies that it
cannot resolve. ``trapezoidal``: the trapezoidal rule with constraints on velocities (index 2): it
damps nothing, and the constraints on positions drift with time.
"""

_SPECTRAL_RADIUS = 0.9
"""Spectral radius of the generalized-alpha method at infinite frequency."""
_SMALLEST_SUBSTEP = 1.0 / 64.0
"""exudyn may reduce a substep to this part of it where Newton's method fails."""
_RELATIVE_TOLERANCE, _ABSOLUTE_TOLERANCE = 1e-4, 1e-6
"""Newton's residual must fall below these, the first relative to the first residual of the step.
If the second one were too small, rounding would keep Newton's method from reaching it at rest."""


def settings_of(step: float, substeps: int, integrator: Integrator) -> exu.SimulationSettings:
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
