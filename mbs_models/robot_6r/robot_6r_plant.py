"""The robot is built in exudyn here: a kinematic tree whose first six joints move the flange.

The flange moves by three sliding and three turning joints without mass; the reduced socket acts
on their coordinates and pulls it back. The drives of the arm are springs and dampers inside the
implicit integration.

The socket's stiffness comes in two ways (see socket_spring). The exact one is a spring of exudyn
between ground and flange. The fast one is linear in the coordinates; the small rest is a force
that is constant over each substep, with its value where the substep would end at constant rates.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from exudyn.itemInterface import (
    MarkerBodyRigid,
    MarkerKinematicTreeRigid,
    NodeGenericODE2,
    ObjectConnectorRigidBodySpringDamper,
    ObjectGenericODE2,
    ObjectGround,
    ObjectKinematicTree,
)

from mbs_models.plants.checks import expect_positive, expect_substeps
from mbs_models.plants.driven_plant import DrivenPlant
from mbs_models.robot_6r.puma_560 import JOINTS
from mbs_models.robot_6r.socket import FLANGE, Socket
from mbs_models.robot_6r.socket_spring import SocketSpring
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.systems.exudyn.plant import Plant

_INITIAL, _CURRENT = exu.ConfigurationType.Initial, exu.ConfigurationType.Current
_MATRICES: Any = exu.Matrix3DList  # exudyn's stubs have no arguments for these
_VECTORS: Any = exu.Vector3DList
_JOINT = exu.JointType
_FLANGE_JOINTS = [
    _JOINT.PrismaticX,
    _JOINT.PrismaticY,
    _JOINT.PrismaticZ,
    _JOINT.RevoluteX,
    _JOINT.RevoluteY,
    _JOINT.RevoluteZ,
]


@dataclass(frozen=True, eq=False)
class Manipulator:
    """A manipulator is an arm on a flexible socket; its drives give P (s - q) + D (s' - q').

    Attributes:
        arm: the rigid arm on the flange.
        proportional, differential: P in N m/rad and D in N m s/rad, shape (6,) each, positive.
        socket: the reduced socket, with internal modes or without.
        damping: stiffness proportional damping of the socket in s.
        step: sample step h in s.
        substeps: integration steps per sample step.
        exact: whether the socket's stiffness is the exact one (see the module).

    Raises:
        ValueError: a value is out of its range.
    """

    arm: SerialChain
    proportional: FloatArray
    differential: FloatArray
    socket: Socket
    damping: float
    step: float
    substeps: int
    exact: bool

    def __post_init__(self) -> None:
        expect_positive(step=self.step)
        expect_substeps(self.substeps)

    @property
    def coordinates(self) -> int:
        """The number of coordinates: flange, joints and internal modes."""
        return JOINTS + len(self.socket.mass)


class ManipulatorPlant:
    """A ManipulatorPlant is the robot in exudyn.

    The coordinates of ``plant`` are the flange's displacement in m and angles in rad (turning
    about x, then the new y, then the new z), the joint angles, the socket's internal coordinates,
    and the desired angles.
    """

    def __init__(self, manipulator: Manipulator) -> None:
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        self._manipulator = manipulator
        stiffness = manipulator.socket.stiffness[:FLANGE, :FLANGE]
        self._spring = SocketSpring.of(stiffness, manipulator.damping)
        self._nodes = [self._add_node(FLANGE + JOINTS)]
        if manipulator.coordinates > FLANGE + JOINTS:
            self._nodes.append(self._add_node(manipulator.coordinates - FLANGE - JOINTS))
        self._tree = self._add_arm()
        self._add_socket()
        self._force = self._add_exact_spring() if manipulator.exact else None
        self._mbs.Assemble()
        self._forces = np.zeros(FLANGE + JOINTS)
        self._substep = manipulator.step / manipulator.substeps
        gains = manipulator.proportional, manipulator.differential
        self._gains = list(zip(*(gain.tolist() for gain in gains), strict=True))
        self._solver = Plant(
            container, self._mbs, manipulator.step, manipulator.substeps, "trapezoidal"
        )
        self.plant = DrivenPlant(self._solver, manipulator.step, JOINTS, self._set_forces)
        if not manipulator.exact:
            self._solver.before_substep = self._before_substep

    def _add_node(self, size: int) -> Any:
        zeros = [0.0] * size
        node = NodeGenericODE2(
            numberOfODE2Coordinates=size,
            referenceCoordinates=zeros,
            initialCoordinates=zeros,
            initialCoordinates_t=zeros,
        )
        return self._mbs.AddNode(node)

    def _add_arm(self) -> Any:
        """Add the six joints of the flange and those of the arm, and return the tree.

        exudyn's link frames lie before the twist alpha of the Denavit-Hartenberg parameters, so
        centres and inertias are turned by it.
        """
        arm = self._manipulator.arm
        turns, offsets = [np.eye(3)] * (FLANGE + 1), [np.zeros(3)] * (FLANGE + 1)
        centres, inertias = [np.zeros(3)] * FLANGE, [np.zeros((3, 3))] * FLANGE
        for offset, alpha, centre, inertia in zip(
            arm.steps, arm.alpha, arm.centres, arm.inertias, strict=True
        ):
            turn = _turn_x(alpha)
            centres.append(offset + turn @ centre)
            inertias.append(turn @ inertia @ turn.T)
            turns.append(turn)
            offsets.append(offset)
        none = np.zeros(FLANGE)
        tree = ObjectKinematicTree(
            nodeNumber=self._nodes[0],
            gravity=arm.gravity,
            jointTypes=_FLANGE_JOINTS + [_JOINT.RevoluteZ] * JOINTS,
            linkParents=np.arange(-1, FLANGE + JOINTS - 1),
            jointTransformations=_MATRICES(turns[:-1]),
            jointOffsets=_VECTORS(offsets[:-1]),
            linkMasses=np.concatenate([none, arm.masses]),
            linkCOMs=_VECTORS(centres),
            linkInertiasCOM=_MATRICES(inertias),
            jointForceVector=np.zeros(FLANGE + JOINTS),
            jointPControlVector=np.concatenate([none, self._manipulator.proportional]),
            jointDControlVector=np.concatenate([none, self._manipulator.differential]),
            jointPositionOffsetVector=np.zeros(FLANGE + JOINTS),
            jointVelocityOffsetVector=np.zeros(FLANGE + JOINTS),
        )
        return self._mbs.AddObject(tree)

    def _add_socket(self) -> None:
        """Add mass, weight and stiffness of the socket, but for what the exact spring does."""
        socket, count = self._manipulator.socket, self._manipulator.coordinates
        where = [*range(FLANGE), *range(FLANGE + JOINTS, count)]
        linear = socket.stiffness.copy()
        if self._manipulator.exact:
            linear[:FLANGE, :FLANGE] = 0.0
        stiffness, weight = _embedded(linear, where, count), np.zeros(count)
        weight[where] = socket.weight @ self._manipulator.arm.gravity
        item = ObjectGenericODE2(
            nodeNumbers=self._nodes,
            massMatrix=_embedded(socket.mass, where, count),
            stiffnessMatrix=stiffness,
            dampingMatrix=self._manipulator.damping * stiffness,
            forceVector=weight,
        )
        self._mbs.AddObject(item)

    def _add_exact_spring(self) -> Any:
        """Add the spring between ground and flange, and return its force, which must live on."""
        mbs = self._mbs
        ground = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.AddObject(ObjectGround())))
        flange = MarkerKinematicTreeRigid(
            objectNumber=self._tree, linkNumber=FLANGE - 1, localPosition=[0.0, 0.0, 0.0]
        )
        spring = mbs.AddObject(
            ObjectConnectorRigidBodySpringDamper(markerNumbers=[ground, mbs.AddMarker(flange)])
        )
        name = "springForceTorqueUserFunction"
        force = CreateSymbolicUserFunction(mbs, self._spring.exudyn_force(), name, spring)
        mbs.SetObjectParameter(spring, name, force)
        return force

    def _before_substep(self, time: float) -> None:
        """Set the second order's share of the socket's forces for a substep, then the drives.

        The time in s is that of the substep's end since the last sample; 0 is the initial state.
        """
        data: Any = self._mbs.systemData
        when = _INITIAL if time == 0.0 else _CURRENT
        places = data.GetODE2Coordinates(when)[:FLANGE]
        rates = data.GetODE2Coordinates_t(when)[:FLANGE]
        if time > 0.0:
            places = places + self._substep * rates
        self._forces[:FLANGE] = self._spring.beyond_linear(places.tolist(), rates.tolist())
        self.plant.move(time)

    def _set_forces(self, angles: list[float], rates: list[float]) -> None:
        """Let the drives pull the joints to desired angles in rad and rates in rad/s."""
        # the tree's own control subtracts P q + D q': what is left to add depends on s alone
        self._forces[FLANGE:] = [
            p * angle + d * rate
            for (p, d), angle, rate in zip(self._gains, angles, rates, strict=True)
        ]
        self._mbs.SetObjectParameter(self._tree, "jointForceVector", self._forces)


def _turn_x(angle: float) -> FloatArray:
    """Return the matrix of a rotation about x by an angle in rad, shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _embedded(matrix: FloatArray, where: list[int], count: int) -> FloatArray:
    """Put a matrix into the rows and columns ``where`` of a zero one, shape (count, count)."""
    result = np.zeros((count, count))
    result[np.ix_(where, where)] = matrix
    return result
