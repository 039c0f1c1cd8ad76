"""True outputs of exudyn models: generalized alpha at a finer step."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from tests.benchmarks.unprepared.kinds import Motion
from tests.benchmarks.unprepared.models import Model, Wanted

FINE = 2
"""Number of steps from one time to the next."""
PARTS = 16
"""Number of parts of a step over which an input is averaged."""


def by_exudyn(model: Model, wanted: Wanted, motions: Sequence[Motion]) -> list[FloatArray]:
    """Simulate by generalized alpha; inputs are set before each step to those around its end."""
    module = model.module()
    wanted.require(module.inputs, module.outputs)
    return [_exudyn_motion(module, wanted, motion) for motion in motions]


def _around(motion: Motion, times: FloatArray, dt: float) -> FloatArray:
    """Return the means of inputs over a step dt about times, so that no jump is early or late."""
    parts = ((np.arange(PARTS) + 0.5) / PARTS - 0.5) * dt
    near = np.maximum(times[:, None] + parts, 0.0)
    return np.asarray(motion(near.ravel()).reshape(len(times), PARTS, -1).mean(axis=1))


def _exudyn_motion(module: Any, wanted: Wanted, motion: Motion) -> FloatArray:
    import exudyn as exu

    container = exu.SystemContainer()  # it owns the system
    mbs = container.AddSystem()
    module.build(mbs, SimpleNamespace(**module.parameters))
    steps = (len(wanted.times) - 1) * FINE
    dt = wanted.step / FINE
    u = _around(motion, np.arange(steps + FINE + 1, dtype=np.float64) * dt, dt)
    targets = []
    for name in wanted.inputs:
        item, parameter = module.inputs[name]["parameter"].split(".")
        targets.append((mbs.GetObjectNumber(item), parameter))

    def give(mbs: Any, t: float) -> bool:
        k = min(max(t / dt, 0.0), len(u) - 1.000001)  # exudyn may halve a step
        row = u[int(k)] + (k - int(k)) * (u[int(k) + 1] - u[int(k)])
        for (number, parameter), value in zip(targets, row, strict=True):
            mbs.SetObjectParameter(number, parameter, float(value))
        return True

    sensors = [mbs.GetSensorNumber(name) for name in wanted.outputs]
    for sensor in sensors:
        mbs.SetSensorParameter(sensor, "storeInternal", True)
        mbs.SetSensorParameter(sensor, "writeToFile", False)
    mbs.Assemble()
    settings: Any = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 0.5 * dt  # a period of several steps slips
    settings.timeIntegration.verboseMode = settings.staticSolver.verboseMode = 0
    give(mbs, 0.0)
    mbs.SolveStatic(settings)
    data, initial = mbs.systemData, exu.ConfigurationType.Initial
    data.SetODE2Coordinates(data.GetODE2Coordinates(), initial)
    data.SetODE2Coordinates_t([0.0] * len(data.GetODE2Coordinates_t()), initial)
    mbs.SetPreStepUserFunction(give)
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = wanted.times[-1]
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    settings.timeIntegration.newton.useModifiedNewton = True
    mbs.SolveDynamic(settings)
    stored = [np.array(mbs.GetSensorStoredData(sensor)) for sensor in sensors]
    return np.stack([np.interp(wanted.times, s[:, 0], s[:, 1]) for s in stored], axis=1)
