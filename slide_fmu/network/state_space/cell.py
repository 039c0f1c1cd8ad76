"""The cell of a state-space network as data: its weights, and which features fit it."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from slide_fmu.network.base import Float32Array
from slide_fmu.network.state_space.equations import GATED, Weights
from slide_fmu.network.state_space.roles import Roles

CELL_ACTIVATIONS = ("tanh", "cubic", GATED)
"""Activations that a cell may have: odd, and both exact and fast in the C runtime."""


@dataclass(frozen=True, eq=False)
class Cell:
    """The weights of a cell: n states, q drives, H units, m static features, R factors, p values.

    All float32.

    Attributes:
        a: shape (n, n).
        b: shape (n, q).
        e: shape (n, H).
        w: shape (H, n + q + 1), its columns in the order [x, f, 1]; of gated units
            (H, n_schedule + 1), [s, 1].
        c: shape (p R, n), the R rows of a value together.
        d: shape (p R, m).
        d0: shape (p R,).
        activation: one of ``CELL_ACTIVATIONS``; without units (H = 0) the cell is linear.
        v: of gated units, shape (H, n + n_gated), [x, g]; else None.

    Raises:
        ValueError: shapes differ, values are not finite, or the activation is unknown.
    """

    a: Float32Array
    b: Float32Array
    e: Float32Array
    w: Float32Array
    c: Float32Array
    d: Float32Array
    d0: Float32Array
    activation: str = "tanh"
    v: Float32Array | None = None

    def __post_init__(self) -> None:
        if self.activation not in CELL_ACTIVATIONS:
            raise ValueError(
                f"cell: activation {self.activation!r}; expected one of {list(CELL_ACTIVATIONS)}"
            )
        matrices = (self.a, self.b, self.e, self.w, self.c, self.d)
        if any(matrix.ndim != 2 for matrix in matrices):
            raise ValueError("cell: a, b, e, w, c or d is no matrix; expected two axes each")
        if (self.v is not None) != self.gated:
            raise ValueError(
                f"cell: activation {self.activation!r} and v {'is' if self.gated else 'not'} "
                "missing; expected v for gated units alone"
            )
        n, q, units, values = len(self.a), self.b.shape[1], self.e.shape[1], len(self.c)
        if n < 1 or values < 1:
            raise ValueError(f"cell of {n} states and {values} values; expected at least one each")
        expected = {
            "a": (n, n),
            "b": (n, q),
            "e": (n, units),
            "w": (units, self.w.shape[1] if self.gated else n + q + 1),
            "c": (values, n),
            "d": (values, self.d.shape[1]),
            "d0": (values,),
        }
        for name, shape in expected.items():
            self._check(name, getattr(self, name), shape)
        if self.v is not None:
            if self.v.ndim != 2 or self.v.shape[1] < n or self.w.shape[1] < 1:
                raise ValueError(
                    f"cell: v of shape {self.v.shape}, w of shape {self.w.shape}; expected at "
                    f"least {n} columns and 1"
                )
            self._check("v", self.v, (units, self.v.shape[1]))

    @property
    def gated(self) -> bool:
        """It is true when the units are gated: the cell is linear parameter-varying (LPV)."""
        return self.activation == GATED

    def weights(self, turned: int) -> Weights:
        """Give the matrices by name, of a cell whose first ``turned`` pairs of states turn."""
        n, w, v = len(self.a), self.w, self.v
        plain = v is None
        return Weights(
            a=self.a,
            b=self.b,
            e=self.e,
            w_x=w[:, :n] if plain else None,
            w_f=w[:, n:-1] if plain else w[:, :-1],
            w_1=w[:, -1],
            v_x=None if v is None else v[:, :n],
            v_g=None if v is None else v[:, n:],
            c=self.c,
            d=self.d,
            d0=self.d0,
            units=self.activation,
            turned=turned,
        )

    def _check(self, name: str, weights: Float32Array, shape: tuple[int, ...]) -> None:
        if weights.shape != shape or weights.dtype != np.float32:
            raise ValueError(
                f"cell: {name} of shape {weights.shape}, {weights.dtype}; expected {shape}, "
                "float32"
            )
        if not np.all(np.isfinite(weights)):
            raise ValueError(f"cell: a weight of {name} is not finite; was the training stable?")

    def count_parameters(self) -> int:
        """Count the weights."""
        values = [getattr(self, field.name) for field in fields(self)]
        return sum(value.size for value in values if isinstance(value, np.ndarray))


def check_roles(cell: Cell, roles: Roles, n_signals: int, turned: int) -> None:
    """Reject roles that do not fit the cell.

    Raises:
        ValueError: with the numbers.
    """
    n, factors = len(cell.a), 1 + len(roles.readout)
    if roles.highest() >= n_signals:
        raise ValueError(
            f"state-space network: role of feature {roles.highest()}; there are {n_signals}"
        )
    found = {"drive": cell.b.shape[1], "static": cell.d.shape[1], "schedule": 0, "gated": 0}
    if cell.v is not None:
        found |= {"schedule": cell.w.shape[1] - 1, "gated": cell.v.shape[1] - n}
    for name, count in found.items():
        if len(getattr(roles, name)) != count:
            raise ValueError(
                f"state-space network: {len(getattr(roles, name))} features are {name}; the "
                f"cell takes {count}"
            )
    if len(cell.c) % factors:
        raise ValueError(
            f"state-space network: {len(cell.c)} rows of c; expected a multiple of {factors}, "
            "one for each factor"
        )
    if not 0 <= 2 * turned <= n or len(roles.turn) != (2 if turned else 0):
        raise ValueError(
            f"state-space network: {turned} turned pairs of {n} states with {len(roles.turn)} "
            "features of the turn; expected none, or cosine and sine and at most half the states"
        )
    if turned and not cell.gated:
        raise ValueError("state-space network: turned states need gated units")
