"""A frame with a hysteretic joint (Bouc-Wen): it keeps in mind where it last turned round."""

inputs = {"force": "N"}
outputs = {"position": "m"}
parameters = {"mass": 1.0, "damping": 2.0, "stiffness": 100.0, "part": 0.5, "yield_at": 0.02}
start = [0.0, 0.0, 0.0]


def f(x, u, p):
    position, velocity, joint = x  # the joint's own displacement in m, at most yield_at
    along = velocity * joint > 0
    rate = velocity * (1 - (abs(joint) / p.yield_at if along else 0.0))
    spring = p.part * p.stiffness * position + (1 - p.part) * p.stiffness * joint
    return [velocity, (u[0] - spring - p.damping * velocity) / p.mass, rate]


def g(x, u, p):
    return x[0]
