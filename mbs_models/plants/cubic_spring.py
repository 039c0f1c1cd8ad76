"""A cubic spring with a damper has the force k s + alpha k s^3 + d s'.

Its statics, its exudyn item and the checks of a system's parameters are here.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from exudyn.advancedUtilities import CreateSymbolicUserFunction
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    CoordinateSpringDamperExt,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
)


def expect(name: str, value: float, fine: bool, expected: str) -> None:
    """Refuse a parameter of a system that is not finite or not ``fine``.

    Raises:
        ValueError: the message has the name, the value, what is expected, and the remedy.
    """
    if not (fine and math.isfinite(value)):
        raise ValueError(
            f"system parameter {name} = {value!r}; expected {expected}: correct the "
            "constructor argument or the recipe's [system.parameters]"
        )


def expect_positive(**values: float) -> None:
    """Refuse parameters that are not positive, by name; ``expect`` raises the ValueError."""
    for name, value in values.items():
        expect(name, value, value > 0, "a positive number")


def expect_not_negative(**values: float) -> None:
    """Refuse negative parameters, by name; ``expect`` raises the ValueError."""
    for name, value in values.items():
        expect(name, value, value >= 0, "zero or positive")


def expect_substeps(substeps: float) -> None:
    """Refuse substeps that are no whole number from 1; ``expect`` raises the ValueError."""
    whole = math.isfinite(substeps) and substeps == int(substeps) and substeps >= 1
    expect("substeps", substeps, whole, "a whole number from 1")


@dataclass(frozen=True)
class CubicSpring:
    """A cubic spring holds the numbers of the force k s + alpha k s^3 + d s'.

    Attributes:
        stiffness: k in N/m, positive.
        damping: d in N s/m, not negative.
        alpha: cubic share in 1/m^2, not negative.

    Raises:
        ValueError: a value is out of its range.
    """

    stiffness: float
    damping: float
    alpha: float

    def __post_init__(self) -> None:
        expect_positive(stiffness=self.stiffness)
        expect_not_negative(damping=self.damping, alpha=self.alpha)

    def deflection(self, force: float) -> float:
        """Return the static deflection s in m under a force in N, from k s + alpha k s^3 = F.

        With alpha > 0 the only real root is s = 2 / r sinh(asinh(1.5 r F / k) / 3) with
        r = sqrt(3 alpha), the hyperbolic form of Cardano's solution.
        """
        root = math.sqrt(3.0 * self.alpha)
        if root == 0.0:
            return force / self.stiffness
        return 2.0 / root * math.sinh(math.asinh(1.5 * root * force / self.stiffness) / 3.0)


def add_marker(mbs: Any, node: Any, coordinate: int = 0) -> Any:
    """Mark a coordinate of a node of an exudyn system and return the marker."""
    return mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))


def add_mass(mbs: Any, mass: float, reference: float = 0.0) -> Any:
    """Put a mass in kg that moves along one axis, and return the marker of its position in m."""
    node = mbs.AddNode(Node1D(referenceCoordinates=[reference]))
    mbs.AddObject(Mass1D(nodeNumber=node, mass=mass))
    return add_marker(mbs, node)


def add_linear_spring(mbs: Any, markers: list[Any], stiffness: float, damping: float) -> None:
    """Put a spring in N/m and a damper in N s/m between the markers of two coordinates."""
    item = CoordinateSpringDamper(markerNumbers=markers, stiffness=stiffness, damping=damping)
    mbs.AddObject(item)


def add_cubic_spring(mbs: Any, markers: list[Any], spring: CubicSpring) -> tuple[Any, Any]:
    """Put a cubic spring between two coordinates, the second minus the first being x.

    Its spring sees s = x - b for a base b that starts a step at the item's ``offset`` and moves
    with its ``velocityOffset``; its damper sees x'. exudyn evaluates the force without Python.

    Returns:
        The object's number, and its force function, which must live as long as the system.
    """
    alpha = spring.alpha
    item = mbs.AddObject(
        CoordinateSpringDamperExt(
            markerNumbers=markers, stiffness=spring.stiffness, damping=spring.damping
        )
    )

    def force(  # type: ignore[no-untyped-def]  # noqa: PLR0913 (exudyn calls it so)
        mbs, t, item, x, v, stiffness, damping, base, base_rate, f1, f2, decay, f3, zone
    ):  # fmt: skip
        s = x - (base + base_rate * t)
        return stiffness * s * (1.0 + alpha * s * s) + damping * v

    symbolic = CreateSymbolicUserFunction(mbs, force, "springForceUserFunction", item)
    mbs.SetObjectParameter(item, "springForceUserFunction", symbolic)
    return item, symbolic
