"""Sample by sample equals one run of exudyn over the whole record."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    LoadCoordinate,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    NodePointGround,
    SensorNode,
)

from mbs_models.oscillators import DuffingOscillator
from slide_fmu.signals import FloatArray
from slide_fmu.systems.base import State, simulate

SAME = 1e-9
"""Of the RMS: time grows in one run and starts anew in the other, the rest is rounding."""


def one_run(inputs: FloatArray, x: float, v: float, step: float, substeps: int) -> FloatArray:
    """A Duffing oscillator from other items, in one solver run; positions, shape (N + 1,)."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node = mbs.AddNode(
        Node1D(referenceCoordinates=[0.0], initialCoordinates=[x], initialVelocities=[v])
    )
    mbs.AddObject(Mass1D(nodeNumber=node, mass=1.0))
    ground = mbs.AddMarker(
        MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0)
    )
    mass = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))

    def spring(mbs: Any, t: float, item: int, u: float, v: float, *_: float) -> float:
        return 1600.0 * u + 800.0 * u**3 + 8.0 * v

    mbs.AddObject(
        CoordinateSpringDamper(markerNumbers=[ground, mass], springForceUserFunction=spring)
    )
    load = mbs.AddLoad(LoadCoordinate(markerNumber=mass, load=0.0))
    sensor = mbs.AddSensor(
        SensorNode(
            nodeNumber=node,
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Coordinates,
        )
    )

    def hold(mbs: Any, t: float) -> bool:
        # exudyn calls this before a step with the time at its end
        mbs.SetLoadParameter(load, "load", inputs[int((t - 1e-9) / step), 0])
        return True

    mbs.SetPreStepUserFunction(hold)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = len(inputs) * step
    settings.timeIntegration.numberOfSteps = len(inputs) * substeps
    settings.timeIntegration.automaticStepSize = False
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = step / substeps
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK67)
    stored: FloatArray = mbs.GetSensorStoredData(sensor)
    assert len(stored) == len(inputs) * substeps + 1
    return stored[::substeps, 1]


def test_stepwise_equals_all_at_once() -> None:
    system = DuffingOscillator()
    inputs = np.random.default_rng(3).uniform(-1000, 1000, (100, 1))
    start = State(np.array([0.4]), np.array([-3.0]), np.zeros(1))
    found = simulate(system, inputs, start).outputs[:, 0]
    expected = one_run(inputs, 0.4, -3.0, system.step, 24)
    assert np.max(np.abs(found - expected)) < SAME * np.sqrt(np.mean(expected**2))
