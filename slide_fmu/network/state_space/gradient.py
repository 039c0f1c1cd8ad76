"""Derivatives of state-space networks by their features are computed in reverse mode, in float64.

The method is backpropagation through time along one run of the cell from x = 0 (Werbos, 1990).
``equations.py`` gives the run, its hidden units and their slopes.
"""

from __future__ import annotations

from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import PullBack
from slide_fmu.network.state_space.cell import in_double
from slide_fmu.network.state_space.equations import ByRole, Equations, rows, turned
from slide_fmu.network.state_space.network import StateSpace


def pull_back_cells(network: StateSpace, features: FloatArray, n_out: int) -> PullBack:
    """Prepare the reverse mode of ``StateSpace.block`` after its features; see ``Family``."""
    return _CellTape(network, features, n_out).pull_back


@final
class _CellTape:
    """A _CellTape is one run of a cell from x = 0 over windows, with its reverse mode."""

    def __init__(self, network: StateSpace, features: FloatArray, n_out: int) -> None:
        self._roles, self._n_out = network.roles, n_out
        self._shape = features.shape
        self._inputs = ByRole.of(network.roles, np.moveaxis(features, 1, 0))
        self._cell = in_double(network.cell)
        self._equations = Equations(self._cell, self._inputs, network.turned, np)
        first = np.zeros((len(features), len(network.cell.a)))
        self._states = np.concatenate([first[None], self._equations.path(first)])

    def pull_back(self, weights: FloatArray) -> FloatArray:
        """Map weights (B, n_out, n_outputs) to the features' gradient, (B, n_in, n_features)."""
        batch, count, n_features = self._shape
        gradient, of_x = np.zeros((count, batch, n_features)), np.zeros(self._states.shape[1:])
        first, substeps = count - self._n_out, self._cell.substeps
        for k in reversed(range(count)):
            if k >= first:
                of_x = of_x + self._pull_back_values(k, weights[:, k - first], gradient[k])
            for place in reversed(range(k * substeps, (k + 1) * substeps)):
                of_x = self._pull_back_step(k, place, of_x, gradient[k])
        return np.moveaxis(gradient, 0, 1)

    def _add(self, gradient: FloatArray, role: str, values: FloatArray) -> None:
        """Add to the gradient of the features of a role; a feature may have several roles."""
        for place, feature in enumerate(getattr(self._roles, role)):
            gradient[:, feature] += values[:, place]

    def _pull_back_values(self, k: int, weights: FloatArray, gradient: FloatArray) -> FloatArray:
        """Pull weights (B, n_outputs) of the values after an input back to the state after it."""
        of, readout = self._cell, self._inputs.readout[k]
        factors = np.concatenate([np.ones((len(readout), 1)), readout], axis=1)
        parts = rows(of, self._after(k), self._inputs.static[k]).reshape(*weights.shape, -1)
        self._add(gradient, "readout", np.einsum("bp,bpr->br", weights, parts[:, :, 1:]))
        of_rows = (weights[:, :, None] * factors[:, None]).reshape(len(readout), -1)
        self._add(gradient, "static", of_rows @ of.d)
        return np.asarray(of_rows @ of.c)

    def _after(self, k: int) -> FloatArray:
        """Return the states after an input, (B, n)."""
        return np.asarray(self._states[(k + 1) * self._cell.substeps])

    def _pull_back_step(
        self, k: int, place: int, of_next: FloatArray, gradient: FloatArray
    ) -> FloatArray:
        """Pull back over one step of input k, which starts at index ``place`` of the path."""
        cell, equations = self._cell, self._equations
        self._add(gradient, "drive", of_next @ cell.b)
        if cell.gated:
            return np.asarray(
                of_next @ cell.a + self._pull_back_gated(k, place, of_next, gradient)
            )
        units = equations.hidden_units_with_slopes(k, self._states[place])
        of_arguments = of_next @ cell.e * units.slope
        self._add(gradient, "drive", of_arguments @ equations.w_f)
        return np.asarray(of_next @ cell.a + of_arguments @ equations.w_x)

    def _pull_back_gated(
        self, k: int, place: int, of_next: FloatArray, gradient: FloatArray
    ) -> FloatArray:
        equations, x, turn = self._equations, self._states[place], self._inputs.turn[k]
        units, pairs, e = equations.hidden_units_with_slopes(k, x), equations.turned, self._cell.e
        of_units = turned(of_next, turn, pairs, np, back=True) @ e
        of_products = of_units * units.gates
        of_seen = of_products @ equations.v_x
        self._add(gradient, "schedule", of_units * units.slope @ equations.w_f)
        self._add(gradient, "gated", of_products @ equations.v_g)
        if pairs > 0:
            of_turn = _of_turn(of_next, units.values @ e.T, pairs)
            of_back = _of_turn(of_seen, x, pairs)
            self._add(gradient, "turn", of_turn + of_back * [1.0, -1.0])  # sin(-a) = -sin(a)
        return np.asarray(turned(of_seen, turn, pairs, np))


def _of_turn(weights: FloatArray, vectors: FloatArray, pairs: int) -> FloatArray:
    """Return the gradient of weights (B, n) times turned vectors by cosine and sine, (B, 2)."""
    a, b, x, y = (
        part[:, first : 2 * pairs : 2] for part in (weights, vectors) for first in (0, 1)
    )
    return np.stack([(a * x + b * y).sum(axis=1), (b * x - a * y).sum(axis=1)], axis=1)
