"""Two tanks with a pump and a valve, as a user writes them; outside of its ranges the model fails.

The pump fills the first tank, whose outflow through a valve fills the second; an outlet empties
that. At rest under 8 L/min and an opening of 0.2 the levels are 3.84 and 1.17 m.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

inputs = {
    "pump": {"unit": "L/min", "range": [1.0, 8.0], "start": 4.0},
    "valve_opening": {"unit": "1", "range": [0.2, 1.0], "start": 0.5},
}
outputs = {"level_1": "m", "level_2": "m"}
start = [0.5, 0.3]
parameters = {"area": 0.005, "valve": 9.216e-5, "outlet": 2.779e-5}

GRAVITY, PER_MINUTE = 9.81, 1.0 / 60_000.0


def f(x: Any, u: Any, p: SimpleNamespace) -> list[float]:
    """Give the rates of the levels in m/s; a level below zero is a mistake of its caller."""
    head = math.sqrt(2.0 * GRAVITY * abs(x[0] - x[1]))
    through = u[1] * p.valve * math.copysign(head, x[0] - x[1])
    out = p.outlet * math.sqrt(2.0 * GRAVITY * x[1])
    return [(u[0] * PER_MINUTE - through) / p.area, (through - out) / p.area]


def g(x: Any, u: Any, p: SimpleNamespace) -> list[float]:
    """Give both levels in m."""
    return [x[0], x[1]]
