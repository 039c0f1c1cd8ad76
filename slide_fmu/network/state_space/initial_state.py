"""The initial state of a record is estimated from its first outputs.

A record that begins in mid-motion has a past that was not measured. A run of the network from zero
state is wrong until it has forgotten that past. From the state that explains the first outputs
best, it is right from the start.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.cell import in_double
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.network import StateSpace

CHANGE = 1e-3
"""Step of the differences that approximate derivatives by the state, in units of the states: the
state is where the errors have no slope by them. Their rounding is far smaller than that of shorter
steps, so that the FMU finds the same state (``fmu/runtime/network/cells_exact.c``)."""
MOST_EVALUATIONS = 50
"""Largest number of runs; the problem is nearly linear, so a few are enough."""
LARGEST_ERROR = 1e6
"""Larger errors, in scaled units, count as this: they mean that the network diverges."""
PRECISION = 1e-14
"""The search ends where errors and states change by no more than this part of them."""
UNSEEN = 1e-3
"""A state of size 1 counts as an error of this size: states that no output shows stay near
zero."""


def initial_state(network: StateSpace, features: NDArray[Any], values: NDArray[Any]) -> FloatArray:
    """Find the state before the first sample, (n,), from the first outputs by least squares.

    Features have the shape (K, n_features); values, (K, n_values), are the scaled outputs after
    them, NaN where unknown. K is small, some tens of samples.

    Raises:
        ValueError: no output is known, or the shapes do not match.
    """
    known = np.isfinite(values)
    if values.shape != (len(features), network.n_values) or not known.any():
        raise ValueError(
            f"values of shape {values.shape}, {int(known.sum())} of them known; expected "
            f"{(len(features), network.n_values)}, and at least one known"
        )
    cell, n = in_double(network.cell), len(network.cell.a)
    row = np.asarray(features, dtype=np.float64)[:, None]

    def residuals(states: FloatArray) -> FloatArray:
        """Return the residuals of several states, (B, n), shape (B, known + n)."""
        inputs = ByRole.of(network.roles, np.repeat(row, len(states), axis=1))
        after = Equations(cell, inputs, network.turned, np).run(states)
        error = np.moveaxis(outputs(cell, after, inputs), 1, 0) - values
        # the network may diverge from a far state: such a step is rejected
        seen = np.nan_to_num(error[:, known], nan=LARGEST_ERROR)
        return np.concatenate(
            [np.clip(seen, -LARGEST_ERROR, LARGEST_ERROR), UNSEEN * states], axis=1
        )

    def slopes(state: FloatArray) -> FloatArray:
        steps = CHANGE * np.concatenate([np.eye(n), -np.eye(n)])
        there, back = np.split(residuals(state + steps), 2)
        return (there - back).T / (2 * CHANGE)

    with np.errstate(over="ignore", invalid="ignore"):
        solution = scipy.optimize.least_squares(
            lambda state: residuals(state[None])[0],
            np.zeros(n),
            jac=slopes,
            method="lm",
            max_nfev=MOST_EVALUATIONS,
            ftol=PRECISION,
            xtol=PRECISION,
            gtol=PRECISION,
        )
    return np.asarray(solution.x)
