"""A buckled beam: two positions of rest; which one it is in, no window of its inputs tells."""

inputs = {"force": "N"}
outputs = {"position": "m"}
parameters = {"mass": 1.0, "damping": 8.0, "stiffness": 100.0, "width": 1.0}
start = [1.0, 0.0]


def f(x, u, p):
    position, velocity = x
    spring = p.stiffness * position * ((position / p.width) ** 2 - 1)
    return [velocity, (u[0] - spring - p.damping * velocity) / p.mass]


def g(x, u, p):
    return x[0]
