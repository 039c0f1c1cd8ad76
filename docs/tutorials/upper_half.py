"""Upper half of a quarter car: a light body, which the force of the lower half moves."""

inputs = {"force": {"unit": "N", "range": [-9000.0, 9000.0]}}
outputs = {"position": {"unit": "m", "range": [-0.1, 0.1]}}
hold = "zero_order"  # the force is constant over each step
parameters = {"mass": 40.0}  # kg
start = [0.0, 0.0]  # height in m, velocity in m/s


def f(x, u, p):
    return [x[1], u[0] / p.mass]


def g(x, u, p):
    return [x[0]]
