"""Values that hold from one time to the next have means over other spans of time."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray


def held_means(times: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Return the means between successive times ``at`` of values that hold from time to time.

    Args:
        times: in s, rising, shape (N,); the last value holds on after the last one.
        values: what holds from each time on, shape (N, n_columns).
        at: in s, rising, from the first of the times on, shape (n + 1,).

    Returns:
        Shape (n, n_columns).
    """
    knots = np.append(times, max(at[-1], times[-1]) + 1.0)
    sums = np.cumsum(values * np.diff(knots)[:, None], axis=0)
    integral = np.concatenate([np.zeros((1, values.shape[1])), sums])
    areas = np.stack([np.interp(at, knots, column) for column in integral.T], axis=1)
    return np.asarray(np.diff(areas, axis=0) / np.diff(at)[:, None])
