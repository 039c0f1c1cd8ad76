"""Equal masses stand in a row that begins at a wall; cubic springs join neighbours.

This module has the parameters of such a row, its statics, and how it is built in exudyn.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    CoordinateSpringDamperExt,
    LoadCoordinate,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    NodePointGround,
    SensorNode,
)
from scipy.optimize import brentq

from mbs_models.plants.checks import expect_not_negative, expect_positive, expect_substeps
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import Linearizable, RandomStates, State
from slide_fmu.systems.exudyn.wired_system import PlantSolver, WiredSystem


@dataclass(frozen=True)
class SpringMasses:
    """A row of masses holds the numbers of m x_i'' + c x_i' + f_i - f_(i+1) = F_i, i = 1 .. n.

    The springs have f_i = k s + alpha k s^3 + d s' with s = x_i - x_(i-1), where x_0 = 0. The row
    ends at a second wall, x_(n+1) = 0, or is free there, f_(n+1) = 0.

    Attributes:
        mass, stiffness: m in kg and k in N/m, positive.
        damping, drag: d and c in N s/m, not negative; c is that of each mass against the ground.
        alpha: cubic share of the springs in 1/m^2, not negative.
        step: sample step h in s, positive.
        substeps: integration steps per sample step, at least 1.
        count: number n of masses.
        loaded: indices of the masses that carry a force F_i, which is an input.
        second_wall: whether the row ends at a second wall.

    Raises:
        ValueError: a value is out of its range.
    """

    mass: float
    stiffness: float
    damping: float
    alpha: float
    step: float
    substeps: int
    drag: float = 0.0
    count: int = 1
    loaded: tuple[int, ...] = (0,)
    second_wall: bool = False

    def __post_init__(self) -> None:
        expect_positive(stiffness=self.stiffness)
        expect_not_negative(damping=self.damping, alpha=self.alpha)
        expect_positive(mass=self.mass, step=self.step)
        expect_not_negative(drag=self.drag)
        expect_substeps(self.substeps)

    def equilibrium(self, forces: FloatArray) -> FloatArray:
        """Return the static positions in m, shape (n,), under loads in N, shape (len(loaded),).

        After each load the spring force is smaller by the load. So the only unknown is the force
        of the first spring. It carries all loads if the row ends free. Between two walls the
        springs' lengths must add up to the distance of the walls: this is one equation with one
        root, since the deflection grows with the force.
        """
        loads = np.zeros(self.count)
        loads[list(self.loaded)] = forces
        carried = np.concatenate([[0.0], np.cumsum(loads)])

        def deflections(first: float) -> FloatArray:
            return np.array([self._deflection(first - c) for c in carried])

        low, high = float(carried.min()), float(carried.max())
        if not self.second_wall:
            first = float(carried[-1])
        elif high > low:
            first = brentq(
                lambda f: float(np.sum(deflections(f))), low, high, xtol=1e-15 * (high - low)
            )
        else:  # without load every spring is at rest, and no root is bracketed
            first = low
        return np.asarray(np.cumsum(deflections(first))[: self.count])

    def _deflection(self, force: float) -> float:
        """Return the static deflection s in m of a spring, from k s + alpha k s^3 = F.

        With alpha > 0 the only real root is s = 2 / r sinh(asinh(1.5 r F / k) / 3) with
        r = sqrt(3 alpha), the hyperbolic form of Cardano's solution.
        """
        root = math.sqrt(3.0 * self.alpha)
        if root == 0.0:
            return force / self.stiffness
        return 2.0 / root * math.sinh(math.asinh(1.5 * root * force / self.stiffness) / 3.0)


class SpringMassSystem(WiredSystem, RandomStates, Linearizable):
    """A row of masses is a system of forces, or of the motion of its first wall, and of positions.

    The coordinates are the positions of the masses in m. Interface: never instantiated.
    """

    solved_by = "RK67"

    def __init__(
        self,
        row: SpringMasses,
        inputs: tuple[Signal, ...],
        outputs: tuple[Signal, ...],
        observed: tuple[int, ...] = (0,),
    ) -> None:
        """Take the signals of a row; the outputs are the positions of the masses ``observed``."""
        solver = PlantSolver(row.step, row.substeps, "explicit", accelerations=False)
        super().__init__(row.count, inputs, outputs, solver)
        self._row, self._observed = row, observed

    def _fill(self, mbs: Any) -> object:
        """Build the row; linear springs on fixed walls do without the slower force function."""
        row = self._row
        wall = add_marker(mbs, mbs.AddNode(NodePointGround()))
        names = {i: output.name for i, output in zip(self._observed, self.outputs, strict=True)}
        masses = [add_mass(mbs, row.mass, sensor=names.get(i)) for i in range(row.count)]
        ends = [wall, *masses, wall] if row.second_wall else [wall, *masses]
        cubic = self._moving or row.alpha > 0
        add_spring = _add_cubic_spring if cubic else _add_linear_spring
        forces = [
            add_spring(mbs, f"spring_{k}", [*pair], row)
            for k, pair in enumerate(pairwise(ends), 1)
        ]
        for marker in masses if row.drag > 0 else []:
            drag = CoordinateSpringDamper(markerNumbers=[wall, marker], damping=row.drag)
            mbs.AddObject(drag)
        for index, force in zip(row.loaded, self.inputs, strict=True):
            if not self._moving:
                mbs.AddLoad(LoadCoordinate(markerNumber=masses[index], name=force.name))
        return forces

    def rest_state(self, held_input: FloatArray) -> State:
        """Return the static deflection under constant forces in N, or with the base at rest in m.

        Raises:
            ValueError: the input, shape (n_inputs,), is not finite.
        """
        held = self._finite_inputs("held input", held_input)
        positions = held.copy() if self._moving else self._row.equilibrium(held)
        return State(positions, np.zeros(self._row.count), held)


def _add_linear_spring(mbs: Any, name: str, markers: list[Any], row: SpringMasses) -> None:
    mbs.AddObject(CoordinateSpringDamper(name, markers, row.stiffness, row.damping))


def _add_cubic_spring(mbs: Any, name: str, markers: list[Any], row: SpringMasses) -> Any:
    """Put a cubic spring between two coordinates, the second minus the first being x.

    Its spring sees s = x - b for a base b that starts a step at the item's ``offset`` and moves
    with its ``velocityOffset``; its damper sees x'. exudyn evaluates the force without Python; it
    is returned, since exudyn keeps no reference to it.
    """
    alpha = row.alpha
    spring = CoordinateSpringDamperExt(name, markers, stiffness=row.stiffness, damping=row.damping)
    item = mbs.AddObject(spring)

    def force(  # type: ignore[no-untyped-def]  # noqa: PLR0913 (exudyn calls it so)
        mbs, t, item, x, v, stiffness, damping, base, base_rate, f1, f2, decay, f3, zone
    ):  # fmt: skip
        s = x - (base + base_rate * t)
        return stiffness * s * (1.0 + alpha * s * s) + damping * v

    symbolic = CreateSymbolicUserFunction(mbs, force, "springForceUserFunction", item)
    mbs.SetObjectParameter(item, "springForceUserFunction", symbolic)
    return symbolic


def add_marker(mbs: Any, node: Any, coordinate: int = 0) -> Any:
    """Mark a coordinate of a node of an exudyn system and return the marker."""
    return mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))


def add_mass(mbs: Any, mass: float, reference: float = 0.0, sensor: str | None = None) -> Any:
    """Put a mass in kg that moves along one axis, and return the marker of its position in m.

    A sensor of the name, if there is one, measures the displacement from the reference in m.
    """
    node = mbs.AddNode(Node1D(referenceCoordinates=[reference]))
    mbs.AddObject(Mass1D(nodeNumber=node, mass=mass))
    if sensor is not None:
        kind = exu.OutputVariableType.Coordinates
        mbs.AddSensor(SensorNode(sensor, nodeNumber=node, outputVariableType=kind))
    return add_marker(mbs, node)
