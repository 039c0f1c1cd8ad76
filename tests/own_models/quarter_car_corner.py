"""Lower half of a quarter car: wheel, tyre, spring and damper; the body is another model's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

inputs = {
    "road": {"unit": "m", "range": [-0.05, 0.05]},
    "body": {"unit": "m", "range": [-0.08, 0.08]},
}
outputs = {"force": "N"}
parameters = {"m": 40.0, "kt": 2e5, "ct": 150.0, "k": 2e4, "k3": 4e6, "c": 1500.0}
hold = "first_order"
start = [0.0, 0.0]


def suspension(x: Any, u: Any, p: SimpleNamespace, du: Any) -> Any:
    """Give the force of spring and damper in N, which follows the rate of the body."""
    d, v = x[0] - u[1], x[1] - du[1]
    return p.k * d + p.k3 * d**3 + p.c * np.tanh(v / 0.5) * 0.5


def f(x: Any, u: Any, p: SimpleNamespace, du: Any) -> list[Any]:
    """Give speed and acceleration of the wheel."""
    force = suspension(x, u, p, du)
    return [x[1], (p.kt * (u[0] - x[0]) + p.ct * (du[0] - x[1]) - force) / p.m]


def g(x: Any, u: Any, p: SimpleNamespace, du: Any) -> list[Any]:
    """Give the force on the body in N."""
    return [suspension(x, u, p, du)]
