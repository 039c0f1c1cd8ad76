"""Values that components exchange at one time are found, also in circles of direct feedthrough."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slide_fmu.core.signals import FloatArray

NEWTONS = 10
"""Largest number of corrections by Newton's method, after sweeps alone did not end."""

MOVED, CLOSE = 1e-6, 1e-9
"""Relative change of a value with which derivatives are measured, and relative agreement."""

Exchange = Callable[[FloatArray], FloatArray]
"""Sets linked inputs, (n_links,), and returns the values that their sources then have."""


def agreeing_values(
    exchange: Exchange, values: FloatArray, sweeps: int
) -> tuple[FloatArray, FloatArray]:
    """Return linked inputs that their sources give back, and what is left, (n_links,) each.

    A chain of components agrees after one sweep for each of them. In a circle, sweeps may take
    long or grow: there Newton's method goes on. If nothing agrees, the values with the smallest
    differences are returned. The components then have the returned values.
    """
    tried: list[tuple[FloatArray, FloatArray]] = []

    def left(inputs: FloatArray) -> FloatArray:
        tried.append((inputs, exchange(inputs) - inputs))
        return tried[-1][1]

    for _ in range(sweeps):
        rest = left(values)
        if np.all(np.abs(rest) <= CLOSE * np.abs(values + rest)):
            return values, np.abs(rest)
        values = values + rest
    for _ in range(NEWTONS):
        slopes = np.zeros((len(values), len(values)))
        rest = left(values)
        if np.all(np.abs(rest) <= CLOSE * np.abs(values + rest)):
            return values, np.abs(rest)
        for i in range(len(values)):
            moved = values.copy()
            moved[i] += (change := MOVED * max(abs(values[i]), 1.0))
            slopes[:, i] = (exchange(moved) - moved - rest) / change
        try:
            values = values - np.linalg.solve(slopes, rest)
        except np.linalg.LinAlgError:
            break
        if not np.all(np.isfinite(values)):
            break
    rests = np.array([np.abs(rest) for _, rest in tried])
    largest = rests.max(axis=0)
    best = int(np.argmin((rests / np.where(largest > 0, largest, 1.0)).max(axis=1)))
    exchange(tried[best][0])
    return tried[best][0], rests[best]
