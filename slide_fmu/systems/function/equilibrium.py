"""Equations x' = f(x) that are a function alone are brought to rest, and linearized there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slide_fmu.core.signals import FloatArray

DIFFERENCE = float(np.cbrt(np.finfo(np.float64).eps))
"""Step of central differences relative to the size of a state: truncation equals rounding."""
STABLE = 1e-6
"""A mode that grows more slowly than this part of the matrix' norm is taken for rounding."""
RESIDUAL = 1e-6
"""An equilibrium is one where f is below this part of what it is a state's size away."""

Field = Callable[[FloatArray], FloatArray]
"""Gives x' = f(x), both of shape (n,)."""


def state_matrix(field: Field, state: FloatArray, sizes: FloatArray) -> FloatArray:
    """Give A = df/dx in 1/s, shape (n, n), at a state by central differences.

    Sizes, shape (n,), are magnitudes that the states usually have; all of them positive.
    """
    steps = DIFFERENCE * np.maximum(np.abs(state), sizes)
    columns = []
    for index, step in enumerate(steps):
        above, below = state.copy(), state.copy()
        above[index] += step
        below[index] -= step
        columns.append((field(above) - field(below)) / (above[index] - below[index]))
    return np.stack(columns, axis=1)


def equilibrium(field: Field, guess: FloatArray, sizes: FloatArray) -> FloatArray | None:
    """Look for a state with f(x) = 0 from a guess, both of shape (n,), where the system stays.

    It is accepted if the search converged, if f is nearly 0 there, and if no mode grows there: a
    system does not rest on top of a hill.
    """
    from scipy.optimize import root

    with np.errstate(all="ignore"):
        solution = root(field, guess, method="hybr")
        state = np.asarray(solution.x, dtype=np.float64)
        rates = field(state)
        if not (solution.success and np.isfinite(rates).all()):
            return None
        matrix = state_matrix(field, state, sizes)
    if not np.isfinite(matrix).all():
        return None
    norm = float(np.linalg.norm(matrix))
    with np.errstate(over="ignore"):  # sizes of a system that grows may be without bounds
        near = np.linalg.norm(rates) <= RESIDUAL * norm * np.linalg.norm(sizes)
    stays = np.max(np.linalg.eigvals(matrix).real) <= STABLE * norm
    return state if near and stays else None
