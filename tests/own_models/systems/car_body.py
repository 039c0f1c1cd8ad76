"""Upper half of a car: suspension, body, and a driver on a seat; the wheel is another model's.

The damper has a rubber bushing, so that the force follows the height of the wheel, not its rate.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

inputs = {"wheel": {"unit": "m", "range": [-0.08, 0.08]}}
outputs = {"force": {"unit": "N", "range": [-5000.0, 5000.0]}}
parameters = {
    "body": 300.0,
    "k": 2e4,
    "k3": 4e6,
    "bushing": 2e5,
    "c": 2500.0,
    "blow_off": 1500.0,
    "driver": 75.0,
    "seat": 1.5e4,
    "seat_damper": 700.0,
}
hold = "first_order"
start = [0.0, 0.0, 0.0, 0.0, 0.0]


def push(wheel: Any, x: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Give the forces in N that a hardening spring and the damper's bushing put on the body."""
    travel = wheel - x[0]
    return p.k * travel + p.k3 * travel**3, p.bushing * (travel - x[4])


def f(x: Any, u: Any, p: SimpleNamespace) -> list[Any]:
    """Give the rates of height and speed of the body and of the driver, and of the damper's way.

    Valves of the damper open at the force ``blow_off`` in N.
    """
    spring, damper = push(u[0], x, p)
    seat = p.seat * (x[0] - x[2]) + p.seat_damper * (x[1] - x[3])
    slip = damper / p.c * (1 + (damper / p.blow_off) ** 2)
    return [x[1], (spring + damper - seat) / p.body, x[3], seat / p.driver, slip]


def g(x: Any, u: Any, p: SimpleNamespace) -> list[Any]:
    """Give the force on the wheel in N."""
    return [-sum(push(u[0], x, p))]
