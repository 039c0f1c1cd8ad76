"""A two-link arm on a flexible base, in exudyn; how far the base puts its load off."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
from exudyn.utilities import SensorKinematicTree, SensorNode

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.features.urdf import read_urdf
from slide_fmu.systems.base import SimulationError, System

ARM = read_urdf(Path(__file__).with_suffix(".urdf")).chain
JOINTS, BASE = ARM.n_joints, 6
STIFFNESS = np.array([1e5, 1e5, 3e5, 2.5e3, 2.5e3, 2.5e3])
"""Of the base in its directions and about its axes, in N/m and N m/rad."""
DAMPING = 8e-3
"""The base's damping is its stiffness times this, in s."""
GAINS = 2e4, 400.0
"""Of both drives, P in N m/rad and D in N m s/rad."""
SUBSTEPS = 5
_KIND = exu.JointType


class TwoLinkArm(System):
    """Two drives follow set points along a cubic B-spline; the base moves on springs.

    Args:
        step: sample step h in s.
    """

    def __init__(self, *, step: float) -> None:
        self.step = step
        self.inputs = (
            Signal("turn", "rad", -3.0, 3.0, "set point of the column", hold="first_order"),
            Signal("lift", "rad", -0.6, 1.4, "set point of the arm", hold="first_order"),
        )
        self.outputs = tuple(
            Signal(f"deviation_{axis}", "m", -0.05, 0.05, f"the load's, along {axis}")
            for axis in "xyz"
        )

    def simulate(self, inputs: FloatArray) -> FloatArray:
        """Simulate from the static equilibrium under the first set points."""
        container = exu.SystemContainer()
        mbs: Any = container.AddSystem()
        tree, sensors = _assembled(mbs)
        points = np.concatenate([np.repeat(inputs[:1], 3, axis=0), inputs])

        def follow(mbs: Any, time: float) -> bool:
            k = min(int(time / self.step - 1e-9), len(inputs) - 1)
            place, rate = _spline(points[k : k + 4], time / self.step - k)
            for name, value in (("Position", place), ("Velocity", rate / self.step)):
                offsets = np.concatenate([np.zeros(BASE), value])
                mbs.SetObjectParameter(tree, f"joint{name}OffsetVector", offsets)
            return True

        follow(mbs, 0.0)
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.timeIntegration.verboseMode = settings.staticSolver.verboseMode = 0
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.timeIntegration.endTime = len(inputs) * self.step
        settings.timeIntegration.numberOfSteps = len(inputs) * SUBSTEPS
        settings.solution.sensors.writePeriod = self.step
        if not mbs.SolveStatic(settings, updateInitialValues=True):
            raise SimulationError("exudyn found no equilibrium; expected set points in range")
        mbs.SetPreStepUserFunction(follow)
        if not mbs.SolveDynamic(settings):
            raise SimulationError("exudyn stopped; expected smoother set points or more substeps")
        load, joints = (mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in sensors)
        return np.asarray(load - ARM.tool_position(joints[:, BASE:]))


def _spline(points: FloatArray, at: float) -> tuple[FloatArray, FloatArray]:
    """Place and change per step of a uniform cubic B-spline, 0 <= at <= 1 in its step."""
    rest = 1 - at
    inner = 3 * at**3 - 6 * at**2 + 4, 3 * rest**3 - 6 * rest**2 + 4
    place = np.array([rest**3, *inner, at**3]) / 6
    slope = 3 * at**2 - 4 * at, -(3 * rest**2 - 4 * rest)
    rate = np.array([-(rest**2), *slope, at**2]) / 2
    return place @ points, rate @ points


def _assembled(mbs: Any) -> tuple[Any, list[Any]]:
    """Add base and arm as one tree, and sensors of the load's place and of all coordinates."""
    zeros, size = np.zeros(BASE + JOINTS), BASE + JOINTS
    node = mbs.AddNode(
        NodeGenericODE2(
            numberOfODE2Coordinates=size,
            referenceCoordinates=zeros,
            initialCoordinates=zeros,
            initialCoordinates_t=zeros,
        )
    )
    turns, offsets = [np.eye(3)] * (BASE + 1), [np.zeros(3)] * (BASE + 1)
    centres, inertias = [np.zeros(3)] * BASE, [np.zeros((3, 3))] * BASE
    inertias[-1] = 0.05 * np.eye(3)
    for i in range(JOINTS):
        turn = _about_z(ARM.theta[i])
        twisted = turn @ _about_x(ARM.alpha[i])
        offset = turn @ ARM.steps[i]
        centres.append(offset + twisted @ ARM.centres[i])
        inertias.append(twisted @ ARM.inertias[i] @ twisted.T)
        turns.append(twisted)
        offsets.append(offset)
    tree = mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            gravity=ARM.gravity,
            jointTypes=[
                *(_KIND.PrismaticX, _KIND.PrismaticY, _KIND.PrismaticZ),
                *(_KIND.RevoluteX, _KIND.RevoluteY, _KIND.RevoluteZ),
                *[_KIND.RevoluteZ] * JOINTS,
            ],
            linkParents=np.arange(-1, size - 1),
            jointTransformations=exu.Matrix3DList(turns[:-1]),
            jointOffsets=exu.Vector3DList(offsets[:-1]),
            linkMasses=np.concatenate([np.zeros(BASE - 1), [3.0], ARM.masses]),
            linkCOMs=exu.Vector3DList(centres),
            linkInertiasCOM=exu.Matrix3DList(inertias),
            jointPControlVector=np.concatenate([STIFFNESS, np.full(JOINTS, GAINS[0])]),
            jointDControlVector=np.concatenate([DAMPING * STIFFNESS, np.full(JOINTS, GAINS[1])]),
            jointPositionOffsetVector=zeros,
            jointVelocityOffsetVector=zeros,
        )
    )
    tool = offsets[-1] + turns[-1] @ ARM.tool
    place = SensorKinematicTree(
        objectNumber=tree,
        linkNumber=size - 1,
        localPosition=tool,
        storeInternal=True,
        outputVariableType=exu.OutputVariableType.Position,
    )
    every = SensorNode(
        nodeNumber=node,
        storeInternal=True,
        outputVariableType=exu.OutputVariableType.Coordinates,
    )
    sensors = [mbs.AddSensor(place), mbs.AddSensor(every)]
    mbs.Assemble()
    return tree, sensors


def _about_z(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_x(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
