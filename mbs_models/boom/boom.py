"""A flexible boom with a load at its tip: length of the cylinder in, force of the cylinder out.

This is one half of a machine that is cut in the cylinder's rod. The other half, a cylinder with
its oil and its valve, takes the force and integrates the length (``cylinder.py``). The boom is a
square steel tube, 4 m long, 100 mm wide, with walls of 5 mm. Its damping in bending is an
assumption, as are stiffness and damping of rod and eyes.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    Cable2D,
    CoordinateConstraint,
    LoadCoordinate,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodePosition,
    NodePoint2DSlope1,
    NodePointGround,
    ObjectGround,
    SpringDamper,
)

from mbs_models.plants.checks import expect_positive, expect_substeps
from mbs_models.plants.moved_plant import MOTION, MovedPlant
from mbs_models.plants.spring_masses import add_marker, add_mass
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import Linearizable, State
from slide_fmu.systems.exudyn.plant import Plant
from slide_fmu.systems.exudyn.plant_system import PlantSystem

LENGTH, ELEMENTS = 4.0, 4
"""Length of the boom in m; the cylinder pushes at the first node behind its foot."""
EYE = LENGTH / ELEMENTS
"""Distance of this node from the foot in m."""
FOOT = (0.0, -1.0)
"""Foot of the cylinder in m from the foot of the boom; the boom lies along x at first."""
GRAVITY = 9.81
"""In m/s^2."""
TUBE_MASS, BENDING_STIFFNESS, AXIAL_STIFFNESS = 14.9, 6.02e5, 4.0e8
"""Mass of the tube in kg/m, E I in N m^2 and E A in N."""
BENDING_DELAY, AXIAL_DELAY = 0.006, 0.001
"""Damping in bending and in stretching, relative to the stiffness, in s."""
STIFFNESS, DAMPING = 5e6, 5e4
"""Of rod and eyes, in N/m and N s/m."""
NODE_COORDINATES = 4
"""Displacements of a node and of its slope vector."""


class Boom(PlantSystem[MovedPlant], Linearizable):
    """The cylinder's length moves the boom; the output is the force with which it pushes.

    The force is P (s - d) + D (s' - d'), with the length s of the cylinder, and the distance d of
    the eyes, between which the rod is pressed together. The boom moves in the plane, with gravity.
    The length moves along a smooth curve through its samples (``MovedPlant``).

    Args:
        load: mass in kg at the tip.
        stiffness, damping: P in N/m and D in N s/m.
        step: sample step h in s.
        substeps: integration steps per sample.

    Raises:
        ValueError: a value is out of its range.
    """

    solved_by = "generalized-alpha"

    def __init__(
        self,
        *,
        load: float = 100.0,
        stiffness: float = STIFFNESS,
        damping: float = DAMPING,
        step: float = 0.01,
        substeps: int = 4,
    ) -> None:
        expect_positive(load=load, stiffness=stiffness, damping=damping, step=step)
        expect_substeps(substeps)
        self._load, self._stiffness, self._damping = load, stiffness, damping
        self.step, self._substeps = step, substeps
        masses = 2
        super().__init__(NODE_COORDINATES * (ELEMENTS + 1) + masses + MOTION, n_inputs=1)
        meaning = "length of the cylinder"
        self.inputs = (Signal("length", "m", 1.2, 1.8, meaning, 1.5, "first_order"),)
        self.outputs = (Signal("force", "N", -30e3, 30e3, "the cylinder's push on the boom"),)
        self._last_input = np.array([1.5])

    def _build(self) -> MovedPlant:
        container = exu.SystemContainer()
        mbs: Any = container.AddSystem()
        nodes = add_boom(mbs, self._load)
        ground = mbs.AddObject(ObjectGround())
        ends = [
            mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[*FOOT, 0.0])),
            mbs.AddMarker(MarkerNodePosition(nodeNumber=nodes[1])),
        ]
        rod = mbs.AddObject(
            SpringDamper(markerNumbers=ends, stiffness=self._stiffness, damping=self._damping)
        )
        mbs.Assemble()

        def extend(length: float, rate: float) -> None:
            mbs.SetObjectParameter(rod, "referenceLength", length)
            mbs.SetObjectParameter(rod, "velocityOffset", rate)

        plant = Plant(container, mbs, self.step, self._substeps, "generalized_alpha")
        return MovedPlant(plant, self.step, extend)

    def _apply(self, model: MovedPlant, inputs: FloatArray) -> None:
        model.go(float(inputs[0]) - model.position)

    def output(self) -> FloatArray:
        """Return the force of the cylinder on the boom in N, shape (1,)."""
        distance, rate, _ = between_eyes(self._coordinates, self._velocities)
        pressed, speed = self._coordinates[-MOTION] - distance, self._velocities[-MOTION] - rate
        return np.array([self._stiffness * pressed + self._damping * speed])

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the static equilibrium at a constant length in m, shape (1,).

        Raises:
            SimulationError: there is none, or it is not found.
            ValueError: the length is not finite.
        """
        held = self._finite_inputs("held input", held_input)
        coordinates = self._model().equilibrium(float(held[0]))
        return State(coordinates, np.zeros(len(coordinates)), held)


def between_eyes(
    coordinates: FloatArray, velocities: FloatArray
) -> tuple[float, float, FloatArray]:
    """Return the distance of the cylinder's eyes in m, its rate, and the direction, (2,).

    Coordinates and velocities are those of the boom, in SI units.
    """
    place = slice(NODE_COORDINATES, NODE_COORDINATES + 2)
    way = np.array([EYE, 0.0]) - FOOT + coordinates[place]
    distance = float(np.hypot(*way))
    return distance, float(way @ velocities[place]) / distance, way / distance


def add_boom(mbs: Any, load: float) -> list[Any]:
    """Add the boom with a load in kg at its tip, and return its nodes."""
    ground = add_marker(mbs, mbs.AddNode(NodePointGround()))
    nodes = [
        mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=[k * EYE, 0.0, 1.0, 0.0]))
        for k in range(ELEMENTS + 1)
    ]
    for k in range(ELEMENTS):
        element = Cable2D(
            nodeNumbers=nodes[k : k + 2],
            length=EYE,
            massPerLength=TUBE_MASS,
            bendingStiffness=BENDING_STIFFNESS,
            bendingDamping=BENDING_DELAY * BENDING_STIFFNESS,
            axialStiffness=AXIAL_STIFFNESS,
            axialDamping=AXIAL_DELAY * AXIAL_STIFFNESS,
        )
        weight = mbs.AddMarker(MarkerBodyMass(bodyNumber=mbs.AddObject(element)))
        mbs.AddLoad(LoadMassProportional(markerNumber=weight, loadVector=[0.0, -GRAVITY, 0.0]))
    tip = [add_marker(mbs, nodes[-1], axis) for axis in (0, 1)]
    for axis in (0, 1):
        hinge = [ground, add_marker(mbs, nodes[0], axis)]
        carried = [add_mass(mbs, load), tip[axis]]
        for pair in (hinge, carried):
            mbs.AddObject(CoordinateConstraint(markerNumbers=pair))
    mbs.AddLoad(LoadCoordinate(markerNumber=tip[1], load=-GRAVITY * load))
    return nodes
