"""The mass chain is built in exudyn here: six masses between two walls, and two loads."""

# mypy: allow-untyped-calls
from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import LoadCoordinate, NodePointGround
from scipy.optimize import brentq

from mbs_models.plants.cubic_spring import (
    CubicSpring,
    add_cubic_spring,
    add_linear_spring,
    add_marker,
    add_mass,
    expect_not_negative,
    expect_positive,
    expect_substeps,
)
from mbs_models.plants.solver import ExplicitPlant
from slide_fmu.core.signals import FloatArray

MASSES = 6
"""The chain has this many masses."""
LOADED = (0, 3)
"""The masses with these indices carry an input force."""


@dataclass(frozen=True)
class Chain:
    """A chain holds the numbers of m x_i'' + c x_i' + f_i - f_(i+1) = F_i, i = 1 .. 6.

    The springs have f_i = k s + alpha k s^3 + d s' with s = x_i - x_(i-1); the walls are at
    x_0 = x_7 = 0.

    Attributes:
        mass: m in kg, positive.
        spring: k, d and alpha of each of the seven springs.
        drag: c in N s/m, not negative; a damper between each mass and the ground.
        step: sample step h in s, positive.
        substeps: integration steps per sample step, at least 1.

    Raises:
        ValueError: a value is out of its range.
    """

    mass: float
    spring: CubicSpring
    drag: float
    step: float
    substeps: int

    def __post_init__(self) -> None:
        expect_positive(mass=self.mass, step=self.step)
        expect_not_negative(drag=self.drag)
        expect_substeps(self.substeps)

    def equilibrium(self, forces: FloatArray) -> FloatArray:
        """Return the static positions in m, shape (6,), under loads in N, shape (2,).

        Behind each load the spring force is smaller by it. So one number is unknown, the force
        of the first spring, and the springs' lengths must add up to the distance of the walls:
        one equation with one root, since the deflection grows with the force.
        """
        loads = np.zeros(MASSES)
        loads[list(LOADED)] = forces
        carried = np.concatenate([[0.0], np.cumsum(loads)])

        def deflections(first: float) -> FloatArray:
            return np.array([self.spring.deflection(first - c) for c in carried])

        low, high = float(carried.min()), float(carried.max())
        first = low
        if high > low:  # without load every spring is at rest, and no root is bracketed
            first = brentq(
                lambda f: float(np.sum(deflections(f))), low, high, xtol=1e-15 * (high - low)
            )
        return np.asarray(np.cumsum(deflections(first))[:MASSES])


class MassChainPlant:
    """This plant is a chain of masses in exudyn; its six coordinates are their positions in m."""

    def __init__(self, chain: Chain) -> None:
        """Build the chain; linear springs do without the slower force function."""
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        wall = add_marker(self._mbs, self._mbs.AddNode(NodePointGround()))
        masses = [add_mass(self._mbs, chain.mass) for _ in range(MASSES)]
        points = [wall, *masses, wall]
        self._forces: list[Any] = []  # exudyn keeps no reference to its force functions
        for before, after in itertools.pairwise(points):
            self._add_spring([before, after], chain.spring)
        for marker in masses if chain.drag > 0 else []:
            add_linear_spring(self._mbs, [wall, marker], 0.0, chain.drag)
        self._loads = [
            self._mbs.AddLoad(LoadCoordinate(markerNumber=masses[index], load=0.0))
            for index in LOADED
        ]
        self._mbs.Assemble()
        self.plant = ExplicitPlant(container, self._mbs, chain.step, chain.substeps)

    def _add_spring(self, markers: list[Any], spring: CubicSpring) -> None:
        if spring.alpha > 0:
            self._forces.append(add_cubic_spring(self._mbs, markers, spring)[1])
        else:
            add_linear_spring(self._mbs, markers, spring.stiffness, spring.damping)

    def set_forces(self, forces: FloatArray) -> None:
        """Let constant forces in N, shape (2,), act on the loaded masses."""
        for load, force in zip(self._loads, forces, strict=True):
            self._mbs.SetLoadParameter(load, "load", float(force))
