"""A tank without outlet: its level is the integral of what flows in, which it never forgets."""

inputs = {"inflow": "m^3/s"}
outputs = {"level": "m"}
parameters = {"area": 2.0}
start = [0.0]


def f(x, u, p):
    return [u[0] / p.area]


def g(x, u, p):
    return x
