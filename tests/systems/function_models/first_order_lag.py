"""A first-order lag as a whole simulation: the exact response to an input that is held."""

import numpy as np

hold = "zero_order"  # u[k, 0] acts from t[k - 1] to t[k]
inputs = {"command": {"unit": "1", "range": [-1, 1]}}
outputs = {"lagged": {"unit": "1", "range": [-2.0, 2.0]}}
parameters = {"time_constant": 0.2, "gain": 2.0}


def simulate(t, u, p):
    kept = np.exp(-(t[1] - t[0]) / p.time_constant)
    y = np.empty(len(t))
    y[0] = p.gain * u[0, 0]
    for k in range(1, len(t)):
        y[k] = kept * y[k - 1] + (1 - kept) * p.gain * u[k, 0]
    return y
