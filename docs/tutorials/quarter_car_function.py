"""Quarter car over a road: cubic bump stop, asymmetric damper, tyre."""

import numpy as np

inputs = {"road": "m"}
outputs = {"body_acceleration": "m/s^2", "suspension_travel": "m", "tyre_deflection": "m"}
hold = "first_order"  # the road goes on linearly between samples
parameters = {
    "body_mass": 300.0,  # kg
    "wheel_mass": 40.0,  # kg
    "spring": 20e3,  # N/m
    "bump_stop": 8e6,  # N/m^3
    "compression": 900.0,  # N s/m
    "rebound": 1800.0,  # N s/m
    "tyre": 180e3,  # N/m
    "tyre_damping": 100.0,  # N s/m
}
start = [0.0, 0.0, 0.0, 0.0]  # heights of body and wheel in m, their velocities in m/s


def forces(x, u, p, du):
    body, wheel, body_velocity, wheel_velocity = x
    travel, rate = body - wheel, body_velocity - wheel_velocity
    damper = np.where(rate > 0, p.rebound, p.compression) * rate
    suspension = p.spring * travel + p.bump_stop * travel**3 + damper
    tyre = p.tyre * (wheel - u[0]) + p.tyre_damping * (wheel_velocity - du[0])
    return suspension, tyre


def f(x, u, p, du):
    suspension, tyre = forces(x, u, p, du)
    return [x[2], x[3], -suspension / p.body_mass, (suspension - tyre) / p.wheel_mass]


def g(x, u, p, du):
    suspension, _ = forces(x, u, p, du)
    return [-suspension / p.body_mass, x[0] - x[1], x[1] - u[0]]
