"""Lower half of a car: a wheel on its tyre; the force of the suspension is another model's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

inputs = {
    "road": {"unit": "m", "range": [-0.05, 0.05]},
    "force": {"unit": "N", "range": [-3000.0, 3000.0]},
}
outputs = {"wheel": {"unit": "m", "range": [-0.08, 0.08]}}
parameters = {"mass": 60.0, "tyre": 1.5e5, "tyre3": 2e7, "tyre_damper": 600.0}
hold = "first_order"
start = [0.0, 0.0]


def f(x: Any, u: Any, p: SimpleNamespace, du: Any) -> list[Any]:
    """Give speed and acceleration of the wheel."""
    pressed = u[0] - x[0]
    tyre = p.tyre * pressed + p.tyre3 * pressed**3 + p.tyre_damper * (du[0] - x[1])
    return [x[1], (tyre + u[1]) / p.mass]


def g(x: Any, u: Any, p: SimpleNamespace, du: Any) -> list[Any]:
    """Give the height of the wheel in m."""
    return [x[0]]
