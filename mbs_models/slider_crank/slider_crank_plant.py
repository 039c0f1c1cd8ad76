"""The slider-crank is built in exudyn here: a rigid crank, a flexible rod, a slider, a drive.

The numbers are those of the paper's section "Planar flexible slider-crank"; the rod is a beam in
the absolute nodal coordinate formulation (exudyn's Cable2D).
"""

# mypy: allow-untyped-calls
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    Cable2D,
    CoordinateConstraint,
    CoordinateSpringDamperExt,
    MarkerBodyPosition,
    MarkerNodePosition,
    NodePoint2DSlope1,
    NodePointGround,
    NodeRigidBody2D,
    ObjectGround,
    RevoluteJoint2D,
    RigidBody2D,
)

from mbs_models.plants.checks import (
    expect,
    expect_not_negative,
    expect_positive,
    expect_substeps,
)
from mbs_models.plants.driven_plant import DrivenPlant
from mbs_models.plants.spring_masses import add_marker, add_mass
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.exudyn.plant import Plant

CRANK_LENGTH, CRANK_MASS = 0.5, 2.0
ROD_LENGTH, ROD_MASS = 1.0, 4.0
"""Lengths are in m and masses in kg; the crank and the rod are uniform."""
AXIAL_STIFFNESS = 414e3
"""Axial stiffness E A of the rod in N."""
BENDING_DELAY, AXIAL_DELAY = 0.015, 0.01
"""Damping of the rod in bending and in stretching, relative to its stiffness, in s."""
CRANK_COORDINATES, NODE_COORDINATES = 3, 4
"""The crank's coordinates are the displacement of its middle and its angle; those of a node of the
rod are the displacement of the node and the deviation of the slope vector. All count from crank
and rod stretched along x."""


@dataclass(frozen=True)
class Mechanism:
    """A mechanism holds the numbers of a slider-crank with a flexible rod in the plane.

    It has no gravity and no friction. The numbers are the arguments of ``SliderCrank``; the number
    of elements is even, so that a node is in the rod's middle.

    Raises:
        ValueError: a value is out of its range.
    """

    proportional: float
    differential: float
    bending_stiffness: float
    slider_mass: float
    elements: int
    step: float
    substeps: int

    def __post_init__(self) -> None:
        expect_not_negative(proportional=self.proportional, differential=self.differential)
        expect_positive(bending_stiffness=self.bending_stiffness, step=self.step)
        expect_positive(slider_mass=self.slider_mass)
        expect_substeps(self.substeps)
        even = self.elements >= 2 and self.elements % 2 == 0
        expect("elements", self.elements, even, "an even whole number from 2")

    @property
    def coordinates(self) -> int:
        """The number of coordinates: the crank's, the rod's, and the slider's displacement."""
        return CRANK_COORDINATES + NODE_COORDINATES * (self.elements + 1) + 1

    def rod_nodes(self, coordinates: FloatArray) -> FloatArray:
        """Return the positions (x, y) of the rod's nodes in m from the crank on, shape (n, 2)."""
        displacements = coordinates[CRANK_COORDINATES : self.coordinates - 1]
        nodes: FloatArray = displacements.reshape(-1, NODE_COORDINATES)[:, :2].copy()
        nodes[:, 0] += CRANK_LENGTH + ROD_LENGTH * np.linspace(0.0, 1.0, self.elements + 1)
        return nodes

    def deflection(self, coordinates: FloatArray) -> float:
        """Return the distance in m of the rod's middle from the straight line between its ends.

        It is positive to the left of the line from the crank to the slider.
        """
        # plain numbers: this is called at every sample, and small arrays are slow
        middle = self.elements // 2
        first, last = CRANK_COORDINATES, CRANK_COORDINATES + NODE_COORDINATES * self.elements
        between = CRANK_COORDINATES + NODE_COORDINATES * middle
        x0, y0 = coordinates[first : first + 2].tolist()
        x1, y1 = coordinates[between : between + 2].tolist()
        x2, y2 = coordinates[last : last + 2].tolist()
        along, across = ROD_LENGTH + x2 - x0, y2 - y0
        cross: float = along * (y1 - y0) - across * (0.5 * ROD_LENGTH + x1 - x0)
        return cross / float(np.hypot(along, across))

    def straight(self, angle: float, speed: float) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and velocities in SI units as if the rod was rigid.

        The crank has the angle in rad and the speed in rad/s.
        """
        crank = np.array([np.cos(angle), np.sin(angle)])
        sine = CRANK_LENGTH * crank[1] / ROD_LENGTH
        rod = np.array([np.sqrt(1.0 - sine**2), -sine])
        rod_speed = -speed * CRANK_LENGTH * crank[0] / (ROD_LENGTH * rod[0])
        crank_rate, rod_rate = speed * _turned(crank), rod_speed * _turned(rod)
        rest = np.array([1.0, 0.0])
        coordinates = self._from_directions(crank - rest, rod - rest)
        velocities = self._from_directions(crank_rate, rod_rate)
        coordinates[2], velocities[2] = angle, speed
        return coordinates, velocities

    def _from_directions(self, crank: FloatArray, rod: FloatArray) -> FloatArray:
        """Return all coordinates but the crank's angle; they are linear in both directions."""
        along = ROD_LENGTH * np.linspace(0.0, 1.0, self.elements + 1)
        points = CRANK_LENGTH * crank + along[:, None] * rod
        nodes = np.hstack([points, np.tile(rod, (self.elements + 1, 1))])
        middle = 0.5 * CRANK_LENGTH * crank
        return np.concatenate([middle, [0.0], nodes.ravel(), points[-1, :1]])


def _turned(direction: FloatArray) -> FloatArray:
    """Turn a vector in the plane left by a quarter turn."""
    return np.array([-direction[1], direction[0]])


class SliderCrankPlant:
    """A SliderCrankPlant is a slider-crank in exudyn; its reference is stretched along x.

    The last coordinate of ``plant`` is the desired angle in rad.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        ground, crank = add_mechanism(self._mbs, mechanism)
        self._drive = self._mbs.AddObject(
            CoordinateSpringDamperExt(
                markerNumbers=[ground, crank],
                stiffness=mechanism.proportional,
                damping=mechanism.differential,
            )
        )
        self._mbs.Assemble()
        step, substeps = mechanism.step, mechanism.substeps
        plant = Plant(container, self._mbs, step, substeps, "generalized_alpha")
        self.plant = DrivenPlant(plant, mechanism.step, 1, self._set_drive)

    def _set_drive(self, angles: list[float], speeds: list[float]) -> None:
        """Let the drive pull the crank to a desired angle in rad and speed in rad/s."""
        self._mbs.SetObjectParameter(self._drive, "offset", angles[0])
        self._mbs.SetObjectParameter(self._drive, "velocityOffset", speeds[0])


def add_mechanism(mbs: Any, mechanism: Mechanism) -> tuple[Any, Any]:
    """Add crank, rod and slider, and return the markers of the ground and of the crank's angle."""
    ground, node, tip = _add_crank(mbs)
    rod = _add_rod(mbs, mechanism)
    _join(mbs, tip, mbs.AddMarker(MarkerNodePosition(nodeNumber=rod[0])))
    _add_slider(mbs, ground, rod[-1], mechanism.slider_mass)
    return ground, add_marker(mbs, node, 2)


def _add_crank(mbs: Any) -> tuple[Any, Any, Any]:
    """Add the crank on its pivot; return the marker of the ground, its node, its tip's marker."""
    half = 0.5 * CRANK_LENGTH
    ground = add_marker(mbs, mbs.AddNode(NodePointGround()), 0)
    node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[half, 0.0, 0.0]))
    inertia = CRANK_MASS * CRANK_LENGTH**2 / 12.0
    body = mbs.AddObject(RigidBody2D(nodeNumber=node, mass=CRANK_MASS, inertia=inertia))
    pivot, tip = (
        mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0.0, 0.0]))
        for x in (-half, half)
    )
    origin = MarkerBodyPosition(bodyNumber=mbs.AddObject(ObjectGround()))
    _join(mbs, mbs.AddMarker(origin), pivot)
    return ground, node, tip


def _add_rod(mbs: Any, mechanism: Mechanism) -> list[Any]:
    """Add the rod's cable elements, and return their nodes."""
    length = ROD_LENGTH / mechanism.elements
    nodes = [
        mbs.AddNode(
            NodePoint2DSlope1(referenceCoordinates=[CRANK_LENGTH + k * length, 0.0, 1.0, 0.0])
        )
        for k in range(mechanism.elements + 1)
    ]
    for k in range(mechanism.elements):
        element = Cable2D(
            nodeNumbers=nodes[k : k + 2],
            length=length,
            massPerLength=ROD_MASS / ROD_LENGTH,
            bendingStiffness=mechanism.bending_stiffness,
            bendingDamping=BENDING_DELAY * mechanism.bending_stiffness,
            axialStiffness=AXIAL_STIFFNESS,
            axialDamping=AXIAL_DELAY * AXIAL_STIFFNESS,
        )
        mbs.AddObject(element)
    return nodes


def _add_slider(mbs: Any, ground: Any, rod_end: Any, mass: float) -> None:
    """Add the slider at the end of the rod, guided along x."""
    slider = add_mass(mbs, mass, CRANK_LENGTH + ROD_LENGTH)
    along, across = (add_marker(mbs, rod_end, axis) for axis in (0, 1))
    for pair in ([slider, along], [ground, across]):
        mbs.AddObject(CoordinateConstraint(markerNumbers=pair))


def _join(mbs: Any, first: Any, second: Any) -> None:
    mbs.AddObject(RevoluteJoint2D(markerNumbers=[first, second]))
