"""The exudyn side of the oscillators: one mass, one spring and damper to the ground, one load."""

# mypy: allow-untyped-calls
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import exudyn as exu
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

from mbs_models.solver import ExplicitPlant


@dataclass(frozen=True)
class Oscillator:
    """Numbers of m x'' + d x' + k s + alpha k s^3 = F, with s = x - b for a base at b.

    Attributes:
        mass: m in kg, positive.
        stiffness: k in N/m, positive.
        damping: d in N s/m, not negative.
        alpha: cubic share of the spring in 1/m^2, not negative.
        step: sample step h in s, positive.
        substeps: integration steps per sample step, at least 1.

    Raises:
        ValueError: a value is out of its range.
    """

    mass: float
    stiffness: float
    damping: float
    alpha: float
    step: float
    substeps: int

    def __post_init__(self) -> None:
        for name in ("mass", "stiffness", "step"):
            _expect(name, getattr(self, name), getattr(self, name) > 0, "a positive number")
        for name in ("damping", "alpha"):
            _expect(name, getattr(self, name), getattr(self, name) >= 0, "zero or positive")
        whole = self.substeps == int(self.substeps)
        _expect("substeps", self.substeps, whole and self.substeps >= 1, "a whole number from 1")

    def deflection(self, force: float) -> float:
        """The static deflection s in m under a force in N: k s + alpha k s^3 = F, solved exactly.

        With alpha > 0 the only real root is s = 2 / r sinh(asinh(1.5 r F / k) / 3),
        r = sqrt(3 alpha).
        """
        root = math.sqrt(3.0 * self.alpha)
        if root == 0.0:
            return force / self.stiffness
        return 2.0 / root * math.sinh(math.asinh(1.5 * root * force / self.stiffness) / 3.0)


class OscillatorPlant:
    """An oscillator in exudyn.

    Attributes:
        plant: steps the system and linearizes it.
    """

    def __init__(self, oscillator: Oscillator, moving_base: bool) -> None:
        """Build it; only a cubic spring or a moving base needs the (slower) force function."""
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        node = self._mbs.AddNode(Node1D(referenceCoordinates=[0.0]))
        self._mbs.AddObject(Mass1D(nodeNumber=node, mass=oscillator.mass))
        ground = self._mbs.AddNode(NodePointGround())
        markers = [
            self._mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=number, coordinate=0))
            for number in (ground, node)
        ]
        if moving_base or oscillator.alpha > 0:
            self._spring = self._add_cubic_spring(oscillator, markers)
        else:
            self._mbs.AddObject(
                CoordinateSpringDamper(
                    markerNumbers=markers,
                    stiffness=oscillator.stiffness,
                    damping=oscillator.damping,
                )
            )
        self._load = self._mbs.AddLoad(LoadCoordinate(markerNumber=markers[1], load=0.0))
        self._mbs.Assemble()
        self.plant = ExplicitPlant(container, self._mbs, oscillator.step, oscillator.substeps)

    def _add_cubic_spring(self, oscillator: Oscillator, markers: list[Any]) -> Any:
        """A spring k s + alpha k s^3 with an absolute damper; its base starts a step at
        ``offset`` and moves with ``velocityOffset``. exudyn evaluates it without Python."""
        alpha = oscillator.alpha
        spring = self._mbs.AddObject(
            CoordinateSpringDamperExt(
                markerNumbers=markers, stiffness=oscillator.stiffness, damping=oscillator.damping
            )
        )

        def force(  # type: ignore[no-untyped-def]  # noqa: PLR0913 (exudyn calls it so)
            mbs, t, item, x, v, stiffness, damping, base, base_rate, f1, f2, decay, f3, zone
        ):  # fmt: skip
            s = x - (base + base_rate * t)
            return stiffness * s * (1.0 + alpha * s * s) + damping * v

        self._force = CreateSymbolicUserFunction(
            self._mbs, force, "springForceUserFunction", spring
        )  # kept: exudyn needs it as long as the system
        self._mbs.SetObjectParameter(spring, "springForceUserFunction", self._force)
        return spring

    def set_force(self, force: float) -> None:
        """Hold a force in N on the mass."""
        self._mbs.SetLoadParameter(self._load, "load", force)

    def set_base(self, base: float, rate: float) -> None:
        """Start the next step with the base at ``base`` m, moving with ``rate`` m/s."""
        self._mbs.SetObjectParameter(self._spring, "offset", base)
        self._mbs.SetObjectParameter(self._spring, "velocityOffset", rate)


def _expect(name: str, value: object, fine: bool, expected: str) -> None:
    """Refuse a parameter that is not finite or out of its range."""
    if not (fine and math.isfinite(float(value))):  # type: ignore[arg-type]
        raise ValueError(
            f"oscillator parameter {name} = {value!r}; expected {expected}: correct the "
            "constructor argument or the recipe's [system.parameters]"
        )
