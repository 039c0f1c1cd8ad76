"""The robot as the paper's authors modelled it: six rigid bodies on a floating frame of reference.

Redundant coordinates with joint constraints, the socket's finite elements on a floating frame that
its bottom holds, markers on the mesh, PD control by torsional springs. Independent of the
package's own model but for parameters and the desired motion; slower by two orders of magnitude.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

import time
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface
from exudyn.itemInterface import (
    GenericJoint,
    MarkerBodyRigid,
    MarkerSuperElementRigid,
    ObjectGround,
    SensorMarker,
    SensorNode,
)
from exudyn.robotics import Robot, RobotBase, RobotLink

from mbs_models.plants.driven_plant import SetPoints
from mbs_models.robot_6r.puma_560 import DAMPING, JOINTS, STIFFNESS, puma_560
from mbs_models.robot_6r.robot_6r import SOCKET_DAMPING
from mbs_models.robot_6r.socket import SocketMesh
from mbs_models.robot_6r.socket_mesh import finite_elements
from slide_fmu.core.signals import FloatArray

AUTHORS_MESH = SocketMesh(element_size=0.05, element_order=1)
ARM = puma_560(np.zeros(3))


class RedundantRobot:
    """The robot at the static equilibrium of a pose; runs once.

    Attributes:
        deviation: of the wrist's centre in m after ``run``, shape (N + 1, 3).
        seconds: CPU time of the integration.
    """

    def __init__(self, mesh: SocketMesh, set_points: FloatArray, step: float) -> None:
        """Build it for desired joint angles in rad, shape (N + 1, 6), one row per sample."""
        self._step, self._motion = step, _motion(set_points, step)
        self._container = exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        self._flange = self._add_socket(mesh)
        self._springs, wrist = self._add_arm(set_points[0])
        kinds = exu.OutputVariableType
        self._sensors = [
            self._mbs.AddSensor(sensor(storeInternal=True, outputVariableType=kind, **where))
            for sensor, where, kind in (
                (SensorNode, {"nodeNumber": wrist}, kinds.Position),
                (SensorMarker, {"markerNumber": self._flange}, kinds.Position),
                (SensorMarker, {"markerNumber": self._flange}, kinds.RotationMatrix),
            )
        ]
        self._mbs.Assemble()

    def _add_socket(self, mesh: SocketMesh) -> Any:
        """The floating frame with its bottom held; gives the flange's marker."""
        mbs = self._mbs
        elements, bottom, flange = finite_elements(mesh)
        body = ObjectFFRFreducedOrderInterface(elements).AddObjectFFRFreducedOrder(
            mbs, gravity=ARM.gravity.tolist(), stiffnessProportionalDamping=SOCKET_DAMPING
        )["oFFRFreducedOrder"]
        markers = [
            mbs.AddMarker(
                MarkerSuperElementRigid(
                    bodyNumber=body,
                    meshNodeNumbers=np.array(nodes),
                    weightingFactors=np.full(len(nodes), 1.0 / len(nodes)),
                )
            )
            for nodes in (bottom, flange)
        ]
        centres = [
            elements.GetNodePositionsAsArray()[nodes].mean(axis=0) for nodes in (bottom, flange)
        ]
        held = MarkerBodyRigid(
            bodyNumber=mbs.AddObject(ObjectGround()), localPosition=centres[0].tolist()
        )
        pair = [mbs.AddMarker(held), markers[0]]
        mbs.AddObject(GenericJoint(markerNumbers=pair, constrainedAxes=[1] * 6))
        self._centre = centres[1]
        return markers[1]

    def _add_arm(self, pose: FloatArray) -> tuple[list[Any], Any]:
        """The arm on the flange; gives its drives and the node of its last link."""
        base = RobotBase(HT=exu.HT(translation=self._centre.tolist()))
        robot = Robot(gravity=ARM.gravity, base=base, referenceConfiguration=pose.tolist())
        for i in range(JOINTS):
            c, s = np.cos(ARM.alpha[i]), np.sin(ARM.alpha[i])
            turn = [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]
            link = RobotLink(
                mass=ARM.masses[i],
                COM=ARM.centres[i],
                inertia=ARM.inertias[i],
                localHT=exu.HT(rotation=turn, translation=ARM.steps[i].tolist()),
                PDcontrol=(STIFFNESS[i], DAMPING[i]),
            )
            robot.AddLink(link)
        made = robot.CreateRedundantCoordinateMBS(
            self._mbs, baseMarker=self._flange, createJointTorqueLoads=False
        )
        return made["springDamperList"], made["nodeList"][-1]

    def _prepare(self, mbs: Any, now: float) -> bool:
        """Set the drives for a time in s, as exudyn calls it before a substep."""
        sample = min(int(now / self._step + 1e-9), len(self._motion) - 1)
        desired, acceleration = self._motion[sample]
        at = desired.after(now - sample * self._step, acceleration)
        for spring, angle, rate in zip(self._springs, at.position, at.rate, strict=True):
            mbs.SetObjectParameter(spring, "offset", float(angle))
            mbs.SetObjectParameter(spring, "velocityOffset", float(rate))
        return True

    def run(self, substeps: int) -> None:
        """Integrate with the authors' settings: trapezoidal, modified Newton, sparse."""
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.staticSolver.verboseMode = 0
        settings.solution.sensors.writePeriod = self._step
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.endTime = self._step * (len(self._motion) - 1)
        settings.timeIntegration.numberOfSteps = substeps * (len(self._motion) - 1)
        self._prepare(self._mbs, 0.0)
        self._mbs.SolveStatic(settings, updateInitialValues=True)
        self._mbs.SetPreStepUserFunction(self._prepare)
        begin = time.process_time()
        self._mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
        self.seconds = time.process_time() - begin
        wrist, flange, turns = (
            self._mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in self._sensors
        )
        rigid = np.einsum("kji,kj->ki", turns.reshape(-1, 3, 3), wrist - flange)
        self.deviation = wrist - self._centre - rigid


def _motion(set_points: FloatArray, step: float) -> list[tuple[SetPoints, FloatArray]]:
    """Desired motion and acceleration at each sample; the last goes on with constant rate."""
    desired, motion = SetPoints.at_rest(set_points[0]), []
    for row in set_points[1:]:
        acceleration = desired.acceleration(row, step)
        motion.append((desired, acceleration))
        desired = desired.after(step, acceleration)
    return [*motion, (desired, np.zeros(JOINTS))]
