"""The oscillators are built in exudyn here: a mass, a spring and damper to the ground, a load."""

# mypy: allow-untyped-calls
from __future__ import annotations

from dataclasses import dataclass

import exudyn as exu
from exudyn.itemInterface import LoadCoordinate, NodePointGround

from mbs_models.plants.cubic_spring import (
    CubicSpring,
    add_cubic_spring,
    add_linear_spring,
    add_marker,
    add_mass,
    expect_positive,
    expect_substeps,
)
from mbs_models.plants.solver import ExplicitPlant


@dataclass(frozen=True)
class Oscillator:
    """An oscillator holds the numbers of m x'' + d x' + k s + alpha k s^3 = F.

    The spring sees s = x - b for a base at b.

    Attributes:
        mass: m in kg, positive.
        spring: d, k and alpha.
        step: sample step h in s, positive.
        substeps: integration steps per sample step, at least 1.

    Raises:
        ValueError: a value is out of its range.
    """

    mass: float
    spring: CubicSpring
    step: float
    substeps: int

    def __post_init__(self) -> None:
        expect_positive(mass=self.mass, step=self.step)
        expect_substeps(self.substeps)


class OscillatorPlant:
    """This plant is an oscillator in exudyn; its one coordinate is the position x in m."""

    def __init__(self, oscillator: Oscillator, moving_base: bool) -> None:
        """Build the oscillator; only a cubic spring or a moving base needs a force function."""
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        mass = add_mass(self._mbs, oscillator.mass)
        markers = [add_marker(self._mbs, self._mbs.AddNode(NodePointGround())), mass]
        spring = oscillator.spring
        if moving_base or spring.alpha > 0:
            # the attribute keeps the force function alive: exudyn holds no reference to it
            self._spring, self._force = add_cubic_spring(self._mbs, markers, spring)
        else:
            add_linear_spring(self._mbs, markers, spring.stiffness, spring.damping)
        self._load = self._mbs.AddLoad(LoadCoordinate(markerNumber=mass, load=0.0))
        self._mbs.Assemble()
        self.plant = ExplicitPlant(container, self._mbs, oscillator.step, oscillator.substeps)

    def set_force(self, force: float) -> None:
        """Let a constant force in N act on the mass."""
        self._mbs.SetLoadParameter(self._load, "load", force)

    def set_base(self, base: float, rate: float) -> None:
        """Start the next step with the base at ``base`` m, moving with ``rate`` m/s."""
        self._mbs.SetObjectParameter(self._spring, "offset", base)
        self._mbs.SetObjectParameter(self._spring, "velocityOffset", rate)
