"""A motor turns one end of the coupling; its controller follows a speed.

The torque P (r - s) + D (r' - s') on the rotor with the angle s follows the angle r, whose rate
r' is the commanded speed. The coupling's torque is held over a step. The parameters are those of a
servo drive with a crossover of some 10 rad/s; a rotor of 0.1 to 2 kg m^2 is lighter to heavier
than the mechanism, whose inertia at the crank is 0.2 to 1.4 kg m^2.
"""

import numpy as np

inputs = {
    "torque": {"unit": "N.m", "range": [-80.0, 80.0]},
    "speed": {"unit": "rad/s", "range": [-6.0, 6.0]},
}
outputs = {
    "shaft_x": {"unit": "1", "range": [-1.0, 1.0]},
    "shaft_y": {"unit": "1", "range": [-1.0, 1.0]},
    "lag": {"unit": "rad", "range": [-1.0, 1.0]},
    "rate": {"unit": "rad/s", "range": [-10.0, 10.0]},
    "work": {"unit": "J", "range": [-1e4, 1e4]},
    "exchanged": {"unit": "J", "range": [0.0, 1e5]},
}
parameters = {"inertia": 0.5, "proportional": 400.0, "differential": 40.0, "offset": 0.0}


def start(u, p):
    """Rest at the angle ``offset`` in rad."""
    return [p.offset, 0.0, 0.0, 0.0, 0.0]


def f(x, u, p):
    """Give rates of angle, its rate, the angle to follow, work on the coupling, and its size."""
    angle, rate, followed = x[:3]
    torque, speed = u
    drive = p.proportional * (followed - angle) + p.differential * (speed - rate)
    return [rate, (drive - torque) / p.inertia, speed, torque * rate, abs(torque * rate)]


def g(x, u, p):
    """Give cosine and sine of the angle, how far it lags behind, its rate, and work."""
    return [np.cos(x[0]), np.sin(x[0]), x[2] - x[0], x[1], x[3], x[4]]
