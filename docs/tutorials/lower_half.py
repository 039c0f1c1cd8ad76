"""Lower half of a quarter car: wheel, tyre, spring and damper, between the road and a body."""

import numpy as np

inputs = {
    "road": {"unit": "m", "range": [-0.05, 0.05]},
    "body": {"unit": "m", "range": [-0.06, 0.06]},
}
outputs = {"force": "N"}
hold = "first_order"  # both move linearly between samples
parameters = {
    "wheel_mass": 40.0,  # kg
    "spring": 20e3,  # N/m
    "bump_stop": 4e6,  # N/m^3
    "damper": 1500.0,  # N s/m
    "tyre": 200e3,  # N/m
    "tyre_damping": 150.0,  # N s/m
}
start = [0.0, 0.0]  # height of the wheel in m, its velocity in m/s


def force(x, u, p, du):
    travel, rate = x[0] - u[1], x[1] - du[1]
    return p.spring * travel + p.bump_stop * travel**3 + p.damper * 0.5 * np.tanh(rate / 0.5)


def f(x, u, p, du):
    tyre = p.tyre * (u[0] - x[0]) + p.tyre_damping * (du[0] - x[1])
    return [x[1], (tyre - force(x, u, p, du)) / p.wheel_mass]


def g(x, u, p, du):
    return [force(x, u, p, du)]
