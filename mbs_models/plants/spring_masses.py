"""Equal masses stand in a row that begins at a wall; cubic springs join neighbours.

The numbers of such a row and its statics are here, and how it is built in exudyn.
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
)
from scipy.optimize import brentq

from mbs_models.plants.checks import expect_not_negative, expect_positive, expect_substeps
from mbs_models.plants.solver import ExplicitPlant
from slide_fmu.core.signals import FloatArray


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

        Behind each load the spring force is smaller by it. So one number is unknown, the force
        of the first spring. It carries all loads where the row ends free; between two walls the
        springs' lengths must add up to the distance of the walls: one equation with one root,
        since the deflection grows with the force.
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


class SpringMassPlant:
    """This plant is a row of masses in exudyn; its coordinates are their positions in m."""

    def __init__(self, row: SpringMasses, moving_base: bool = False) -> None:
        """Build the row, at rest; its first wall is a base that may move.

        Linear springs on fixed walls do without the slower force function.
        """
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        wall = add_marker(self._mbs, self._mbs.AddNode(NodePointGround()))
        masses = [add_mass(self._mbs, row.mass) for _ in range(row.count)]
        ends = [wall, *masses, wall] if row.second_wall else [wall, *masses]
        self._forces: list[Any] = []  # exudyn keeps no reference to its force functions
        cubic = moving_base or row.alpha > 0
        add_spring = self._add_cubic_spring if cubic else self._add_linear_spring
        self._springs = [add_spring([before, after], row) for before, after in pairwise(ends)]
        for marker in masses if row.drag > 0 else []:
            self._add(CoordinateSpringDamper, [wall, marker], 0.0, row.drag)
        self._loads = [
            self._mbs.AddLoad(LoadCoordinate(markerNumber=masses[index], load=0.0))
            for index in row.loaded
        ]
        self._mbs.Assemble()
        self.plant = ExplicitPlant(container, self._mbs, row.step, row.substeps)

    def set_forces(self, forces: FloatArray) -> None:
        """Let constant forces in N, shape (len(loaded),), act on the loaded masses."""
        for load, force in zip(self._loads, forces, strict=True):
            self._mbs.SetLoadParameter(load, "load", float(force))

    def set_base(self, base: float, rate: float) -> None:
        """Start the next step with the first wall at ``base`` m, moving with ``rate`` m/s."""
        self._mbs.SetObjectParameter(self._springs[0], "offset", base)
        self._mbs.SetObjectParameter(self._springs[0], "velocityOffset", rate)

    def _add(self, item: Any, markers: list[Any], stiffness: float, damping: float) -> Any:
        return self._mbs.AddObject(
            item(markerNumbers=markers, stiffness=stiffness, damping=damping)
        )

    def _add_linear_spring(self, markers: list[Any], row: SpringMasses) -> Any:
        return self._add(CoordinateSpringDamper, markers, row.stiffness, row.damping)

    def _add_cubic_spring(self, markers: list[Any], row: SpringMasses) -> Any:
        """Put a cubic spring between two coordinates, the second minus the first being x.

        Its spring sees s = x - b for a base b that starts a step at the item's ``offset`` and
        moves with its ``velocityOffset``; its damper sees x'. exudyn evaluates the force without
        Python.
        """
        alpha = row.alpha
        item = self._add(CoordinateSpringDamperExt, markers, row.stiffness, row.damping)

        def force(  # type: ignore[no-untyped-def]  # noqa: PLR0913 (exudyn calls it so)
            mbs, t, item, x, v, stiffness, damping, base, base_rate, f1, f2, decay, f3, zone
        ):  # fmt: skip
            s = x - (base + base_rate * t)
            return stiffness * s * (1.0 + alpha * s * s) + damping * v

        symbolic = CreateSymbolicUserFunction(self._mbs, force, "springForceUserFunction", item)
        self._mbs.SetObjectParameter(item, "springForceUserFunction", symbolic)
        self._forces.append(symbolic)
        return item


def add_marker(mbs: Any, node: Any, coordinate: int = 0) -> Any:
    """Mark a coordinate of a node of an exudyn system and return the marker."""
    return mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))


def add_mass(mbs: Any, mass: float, reference: float = 0.0) -> Any:
    """Put a mass in kg that moves along one axis, and return the marker of its position in m."""
    node = mbs.AddNode(Node1D(referenceCoordinates=[reference]))
    mbs.AddObject(Mass1D(nodeNumber=node, mass=mass))
    return add_marker(mbs, node)
