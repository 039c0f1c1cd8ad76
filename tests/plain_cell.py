"""The cell of a state-space network in plain loops and float64, straight from its definition.

The only oracle of the cell: for the evaluation in numpy, the fits in torch and the C runtime.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.cell import Roles
from slide_fmu.network.state_space.network import StateSpace


@dataclass(frozen=True, eq=False)
class PlainCell:
    """A cell with weights of any precision: as ``Cell``, with its roles and its turned pairs."""

    a: FloatArray
    b: FloatArray
    e: FloatArray
    w: FloatArray
    c: FloatArray
    d: FloatArray
    d0: FloatArray
    activation: str
    v: FloatArray | None
    roles: Roles
    turned: int
    substeps: int = 1

    @staticmethod
    def of(network: StateSpace) -> PlainCell:
        parts = {
            name: np.asarray(value, np.float64) if isinstance(value, np.ndarray) else value
            for name, value in vars(network.cell).items()
        }
        return PlainCell(**parts, roles=network.roles, turned=network.turned)

    def role(self, features: FloatArray, name: str) -> FloatArray:
        return np.asarray(features[list(getattr(self.roles, name))])

    def turn(self, features: FloatArray) -> FloatArray:
        """The matrix that turns states out of the frame of gated units."""
        matrix = np.eye(len(self.a))
        for i in range(0, 2 * self.turned, 2):
            c, s = self.role(features, "turn")
            matrix[i : i + 2, i : i + 2] = [[c, -s], [s, c]]
        return matrix

    def unit(self, index: int, inner: float) -> float:
        """One of the units that see the states by W."""
        if self.activation == "cubic":
            return inner**3
        if self.activation == "mixed" and index % 2 == 0:
            return max(-8.0, min(8.0, inner)) ** 3
        return math.tanh(inner)

    def units(self, x: FloatArray, features: FloatArray) -> FloatArray:
        """What the units add to the next state."""
        if self.v is None:
            inner = self.w @ np.concatenate([x, self.role(features, "drive"), [1.0]])
            return np.asarray(self.e @ [self.unit(i, z) for i, z in enumerate(inner)])
        turn = self.turn(features)
        gates = np.tanh(self.w @ np.append(self.role(features, "schedule"), 1.0))
        offered = self.v @ np.concatenate([turn.T @ x, self.role(features, "gated")])
        return np.asarray(turn @ self.e @ (gates * offered))

    def step(self, x: FloatArray, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The next state (n,) and its values (n_values,)."""
        for _ in range(self.substeps):
            x = self.a @ x + self.b @ self.role(features, "drive") + self.units(x, features)
        rows = self.c @ x + self.d @ self.role(features, "static") + self.d0
        factors = np.array([1.0, *self.role(features, "readout")])
        return x, rows.reshape(-1, len(factors)) @ factors

    def run(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and states after each sample of features, (N, ...), from x = 0."""
        x, values, states = np.zeros(len(self.a)), [], []
        for row in features:
            x, y = self.step(x, row)
            values.append(y)
            states.append(x)
        return np.array(values), np.array(states)
