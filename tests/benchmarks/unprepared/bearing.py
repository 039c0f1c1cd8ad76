"""Fan rotor in preloaded rolling bearings, housing on a steel frame with rubber pads.

It runs between 60 and 160 rad/s; the frame's resonances lie in between. Inputs are the
components of the unbalance (or any other) force on the rotor, in a frame that stands still.
"""

import numpy as np

inputs = {
    "force_x": {"unit": "N", "range": [-160.0, 160.0]},
    "force_y": {"unit": "N", "range": [-160.0, 160.0]},
}
outputs = {"housing_vx": "mm/s", "housing_vy": "mm/s", "journal_y": "um"}
parameters = {
    "m_rotor": 18.0,  # kg
    "m_housing": 62.0,  # kg
    "K_hertz": 4.5e8,  # N/m^1.5, both bearings, for each of the two opposed sides
    "preload": 9e-6,  # m
    "c_bearing": 1500.0,  # N s/m
    "kx": 7.4e5,  # N/m, rubber pads and frame
    "ky": 1.35e6,
    "pad_cubic": 3.0e11,  # N/m^3, pads get stiffer
    "cx": 1150.0,  # N s/m
    "cy": 1500.0,
    "k_cross": 4.0e4,  # N/m, the frame is not symmetric
    "gravity": 9.81,
}
start = [0.0, -3e-5, 0.0, -5.8e-4, 0.0, 0.0, 0.0, 0.0]  # rotor - housing x, y; housing x, y; rates


def bearing_force(dx, dy, p):
    r = np.sqrt(dx**2 + dy**2 + 1e-16)
    near = np.maximum(p.preload + r, 0.0) ** 1.5
    far = np.maximum(p.preload - r, 0.0) ** 1.5
    pull = p.K_hertz * (near - far) / r
    return pull * dx, pull * dy


def f(x, u, p):
    rx, ry, hx, hy, vrx, vry, vhx, vhy = x
    fx, fy = bearing_force(rx, ry, p)
    fx = fx + p.c_bearing * vrx
    fy = fy + p.c_bearing * vry
    pad_x = p.kx * hx + p.k_cross * hy + p.pad_cubic * hx**3 + p.cx * vhx
    pad_y = p.ky * hy + p.k_cross * hx + p.pad_cubic * hy**3 + p.cy * vhy
    ahx = (fx - pad_x) / p.m_housing
    ahy = (fy - pad_y) / p.m_housing - p.gravity
    arx = (u[0] - fx) / p.m_rotor
    ary = (u[1] - fy) / p.m_rotor - p.gravity
    return [vrx, vry, vhx, vhy, arx - ahx, ary - ahy, ahx, ahy]


def g(x, u, p):
    return [1e3 * x[6], 1e3 * x[7], 1e6 * x[1]]
