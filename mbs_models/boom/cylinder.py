"""A hydraulic cylinder with its valve and a pump of constant pressure: force in, length out.

Both chambers are filled with oil of a constant bulk modulus, which takes up the difference of the
flows; oil leaks past the piston. The valve has four edges, through which oil flows like the root
of the pressure difference. Bore 50 mm, rod 28 mm, stroke 0.8 m and a pressure of 150 bar are usual
of a loader crane; leakage, friction and the moved mass are assumptions.
"""

import math

inputs = {
    "force": {"unit": "N", "range": [-30e3, 30e3]},
    "valve": {"unit": "1", "range": [-1.0, 1.0]},
}
outputs = {
    "length": {"unit": "m", "range": [1.1, 1.9]},
    "rate": {"unit": "m/s", "range": [-1.0, 1.0]},
    "pressure": {"unit": "bar", "range": [0.0, 300.0]},
    "work": {"unit": "J", "range": [-1e6, 1e6]},
    "exchanged": {"unit": "J", "range": [0.0, 1e7]},
}
parameters = {
    "mass": 20.0,
    "friction": 1e4,
    "bulk_modulus": 1.2e9,
    "valve_flow": 1.9e-7,
    "leakage": 5e-13,
    "supply": 150e5,
    "length": 1.5,
    "load": 7000.0,
}

BORE_AREA, ROD_AREA = 1.963e-3, 1.348e-3
"""Areas of the piston in m^2, without and with the rod."""
SHORTEST, LONGEST = 1.05, 1.95
"""Lengths in m at which one of the chambers is empty."""
DEAD_VOLUME = 1e-4
"""Of each chamber, with its hose, in m^3."""
ROUNDED = 1e3
"""Pressure difference in Pa below which the flow is no longer like its root."""


def start(u, p):
    """Hold the force at the length, both parameters; rod's chamber at a third of the supply."""
    rod = p.supply / 3
    return [p.length, 0.0, (p.load + ROD_AREA * rod) / BORE_AREA, rod, 0.0, 0.0]


def pressure_rates(length, rate, pressures, valve, p):
    """Give the rates of both pressures in Pa/s: of the bore's chamber, and of the rod's."""
    bore, rod = pressures
    opened, reversed_ = max(valve, 0.0), max(-valve, 0.0)
    leak = p.leakage * (bore - rod)
    into_bore = opened * _root(p.supply - bore) - reversed_ * _root(bore)
    into_rod = reversed_ * _root(p.supply - rod) - opened * _root(rod)
    volumes = (
        DEAD_VOLUME + BORE_AREA * (length - SHORTEST),
        DEAD_VOLUME + ROD_AREA * (LONGEST - length),
    )
    return (
        p.bulk_modulus / volumes[0] * (p.valve_flow * into_bore - BORE_AREA * rate - leak),
        p.bulk_modulus / volumes[1] * (p.valve_flow * into_rod + ROD_AREA * rate + leak),
    )


def push(pressures, rate, p):
    """Give the force in N of the oil on the piston, less friction."""
    return BORE_AREA * pressures[0] - ROD_AREA * pressures[1] - p.friction * rate


def f(x, u, p):
    """Give rates of length, its rate, both pressures, work on the boom, and its size."""
    length, rate, bore, rod = x[:4]
    force, valve = u
    rates = pressure_rates(length, rate, (bore, rod), valve, p)
    power = force * rate
    return [rate, (push((bore, rod), rate, p) - force) / p.mass, *rates, power, abs(power)]


def g(x, u, p):
    """Give length, its rate, the bore's pressure, and work."""
    return [x[0], x[1], 1e-5 * x[2], x[4], x[5]]


def _root(difference):
    return difference / math.sqrt(math.hypot(difference, ROUNDED))
