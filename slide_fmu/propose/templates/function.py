"""A mass on a hardening spring under a force: change this into the equations of your own model.

f gives the rates of the states x, g the outputs; u holds the inputs, p the parameters. All that
may be written here is on the page "Your own model" of the documentation.
"""

inputs = {"force": {"unit": "N", "range": [-10.0, 10.0]}}
outputs = {"position": "m", "velocity": "m/s"}
parameters = {"mass": 1.0, "damping": 4.0, "stiffness": 100.0, "hardening": 1000.0}
start = [0.0, 0.0]  # position in m and velocity in m/s, from where the state of rest is looked for


# Many motions are simulated at once where f and g accept arrays: position is then one number or an
# array of them. So write np.where(v > 0, a, b) in place of if, and np.tanh in place of math.tanh.
def f(x, u, p):
    position, velocity = x
    spring = p.stiffness * position + p.hardening * position**3
    return [velocity, (u[0] - p.damping * velocity - spring) / p.mass]


def g(x, u, p):
    return x
