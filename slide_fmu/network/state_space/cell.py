"""The cell of a state-space network is data: its matrices, and the role of each feature.

The equations are in ``equations.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, cast

import numpy as np

from slide_fmu.network.activations import Array

GATED = "gated"
"""Hidden units that are linear in the states; their gates are tanh."""

MIXED_UNITS = "mixed"
"""Hidden units that alternate: clipped cube (first, third, ...) and ``tanh``. Beyond the training
data tanh saturates, while the cube continues like a hardening spring."""

MOST_SUBSTEPS = 16
"""Largest number of sub-steps of a cell: parts of a sample step. Faster motions between samples
cannot be learnt, and files with more are damaged."""

CELL_ACTIVATIONS = ("tanh", "cubic", GATED, MIXED_UNITS)
"""Activations of a cell: odd functions, exact and fast in the C runtime."""


@dataclass(frozen=True)
class Roles:
    """Roles say which features a state-space network uses for what, as indices of its features.

    Attributes:
        drive: f, the state input, which moves the states.
        static: w, the feedthrough, which acts on the values directly.
        gated: g, which gated (LPV) units multiply together with the states.
        schedule: s, the scheduling variables, which open and close gated units.
        readout: r, factors of the values in addition to the constant one.
        turn: cosine and sine of the angle of the frame in which gated units act; or empty.
    """

    drive: tuple[int, ...]
    static: tuple[int, ...]
    gated: tuple[int, ...] = ()
    schedule: tuple[int, ...] = ()
    readout: tuple[int, ...] = ()
    turn: tuple[int, ...] = ()

    def highest(self) -> int:
        """The highest index used; -1 if no index is used."""
        return max((i for field in fields(self) for i in getattr(self, field.name)), default=-1)


@dataclass(frozen=True, eq=False)
class Cell:
    """A Cell has n states, q state inputs, H hidden units, m static features, R factors, p values.

    Its matrices are numpy arrays, float32 in a network, or torch tensors during a fit.

    Attributes:
        a: A, shape (n, n).
        b: B, shape (n, q).
        e: E, shape (n, H).
        w: W, shape (H, n + q + 1), its columns in the order [x, f, 1]; with gated units (H,
            n_schedule + 1), [s, 1]. A fit without constant terms omits the last column.
        c: C, shape (p R, n), the R rows of a value together.
        d: D, shape (p R, m).
        d0: shape (p R,).
        activation: one of ``CELL_ACTIVATIONS``; without hidden units (H = 0) the cell is linear.
        v: V of gated units, shape (H, n + n_gated), [x, g]; else None.
        substeps: number of steps of the states in each sample, with the same features. A hardening
            spring is a cube in a short step, but not in a long one.
    """

    a: Array
    b: Array
    e: Array
    w: Array
    c: Array
    d: Array
    d0: Array
    activation: str = "tanh"
    v: Array | None = None
    substeps: int = 1

    @property
    def gated(self) -> bool:
        """Whether the hidden units are gated: the cell is linear parameter-varying (LPV)."""
        return self.activation == GATED

    def arrays(self) -> dict[str, Array]:
        """Return the matrices by name, in the order of their bytes."""
        names = ("a", "b", "e", "w", *(["v"] if self.v is not None else []), "c", "d", "d0")
        return {name: getattr(self, name) for name in names}

    def with_arrays(self, arrays: Mapping[str, Array]) -> Cell:
        """Give the cell with other matrices, by name."""
        return replace(self, **cast("Any", arrays))


def in_double(cell: Cell) -> Cell:
    """Return the cell with its weights in double precision."""
    return cell.with_arrays({n: array.astype(np.float64) for n, array in cell.arrays().items()})


def cell_shapes(
    roles: Roles, activation: str, n: int, units: int, rows: int, bias: bool = True
) -> dict[str, tuple[int, ...]]:
    """Return the shapes of a cell's matrices by name, in the order of their bytes.

    Only gated units have a V. C has p R rows. Without ``bias`` there are no constant terms: the
    last column of W and d0 are absent.
    """
    gated = activation == GATED
    seen = len(roles.schedule) if gated else n + len(roles.drive)
    return {
        "a": (n, n),
        "b": (n, len(roles.drive)),
        "e": (n, units),
        "w": (units, seen + bias),
        **({"v": (units, n + len(roles.gated))} if gated else {}),
        "c": (rows, n),
        "d": (rows, len(roles.static)),
        **({"d0": (rows,)} if bias else {}),
    }


def check_cell(cell: Cell, roles: Roles, n_signals: int, turned: int) -> None:
    """Reject a cell of wrong shapes or weights, or roles beyond the ``n_signals`` features.

    Raises:
        ValueError: a shape is wrong, a weight not float32 or not finite, the activation unknown,
            or a feature of a role does not exist. The message has the values found and expected.
    """
    _check_kind(cell)
    if roles.highest() >= n_signals:
        raise ValueError(
            f"state-space network: role of feature {roles.highest()}; there are {n_signals}"
        )
    n, units, rows, factors = len(cell.a), len(cell.w), len(cell.c), 1 + len(roles.readout)
    if n < 1 or rows < 1 or rows % factors:
        raise ValueError(
            f"cell of {n} states and {rows} rows of c; expected at least one state, and a "
            f"multiple of {factors} rows, one for each factor"
        )
    expected = cell_shapes(roles, cell.activation, n, units, rows)
    for name, weights in cell.arrays().items():
        if weights.shape != expected[name] or weights.dtype != np.float32:
            raise ValueError(
                f"cell: {name} of shape {weights.shape}, {weights.dtype}; expected "
                f"{expected[name]}, float32, for the roles of the features {roles}"
            )
        if not np.all(np.isfinite(weights)):
            raise ValueError(f"cell: a weight of {name} is not finite; was the training stable?")
    if not 0 <= 2 * turned <= n or len(roles.turn) != (2 if turned else 0):
        raise ValueError(
            f"state-space network: {turned} turned pairs of {n} states with {len(roles.turn)} "
            "features of the turn; expected none, or cosine and sine and at most half the states"
        )
    if not cell.gated and (roles.gated or roles.schedule or turned):
        raise ValueError(
            "state-space network: gated, scheduling or turned features of a cell "
            f"with {cell.activation} units; expected them for gated units only"
        )


def _check_kind(cell: Cell) -> None:
    """Reject an unknown activation, a wrong number of sub-steps, and a V that does not fit."""
    if cell.activation not in CELL_ACTIVATIONS:
        raise ValueError(
            f"cell: activation {cell.activation!r}; expected one of {list(CELL_ACTIVATIONS)}"
        )
    if not 1 <= cell.substeps <= MOST_SUBSTEPS:
        raise ValueError(f"cell: {cell.substeps} sub-steps; expected 1 to {MOST_SUBSTEPS}")
    if (cell.v is not None) != cell.gated:
        raise ValueError(
            f"cell: activation {cell.activation!r} and v {'is' if cell.gated else 'not'} "
            "missing; expected v for gated units only"
        )
