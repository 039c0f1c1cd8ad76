"""A cart on a hardening spring, driven by the force of a motor that follows its voltage late."""

inputs = {"voltage": "V"}
outputs = {"position": "m", "force": "N"}
parameters = {
    "mass": 2.0,
    "damping": 24.0,
    "stiffness": 80.0,
    "cubic": 300.0,
    "lag": 0.05,
    "gain": 2.0,
}
start = [0.0, 0.0, 0.0]


def f(x, u, p):
    """Return the rates of position, speed and force."""
    spring = p.stiffness * x[0] + p.cubic * x[0] ** 3
    return [x[1], (x[2] - p.damping * x[1] - spring) / p.mass, (p.gain * u[0] - x[2]) / p.lag]


def g(x, u, p):
    """Return position and force."""
    return [x[0], x[2]]
