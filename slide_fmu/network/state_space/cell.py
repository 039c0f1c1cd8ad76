"""The cell of a state-space network as data: its matrices, and what each feature is for in it.

The equations are in ``equations.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, cast

import numpy as np

from slide_fmu.network.activations import Array

GATED = "gated"
"""The units that are linear in the states; their gates are those of ``tanh``."""

MIXED_UNITS = "mixed"
"""Units of which every second one, from the first on, is a clipped cube, and the others ``tanh``:
tanh alone saturates just beyond what was learnt, where a spring that hardens goes on as a cube."""

MOST_SUBSTEPS = 16
"""A cell has at most so many sub-steps: a bound against damaged files."""

CELL_ACTIVATIONS = ("tanh", "cubic", GATED, MIXED_UNITS)
"""Activations that a cell may have: odd, and both exact and fast in the C runtime."""


@dataclass(frozen=True)
class Roles:
    """This says which signals a state-space network uses, and for what: indices of its features.

    Attributes:
        drive: f, the state input, which moves the states.
        static: w, the feedthrough, which the values follow at once.
        gated: g, which gated (LPV) units multiply beside the states.
        schedule: s, the scheduling variables, which open and close gated units.
        readout: r, factors of the values beside the constant one.
        turn: cosine and sine of the angle of the frame in which gated units act; or none.
    """

    drive: tuple[int, ...]
    static: tuple[int, ...]
    gated: tuple[int, ...] = ()
    schedule: tuple[int, ...] = ()
    readout: tuple[int, ...] = ()
    turn: tuple[int, ...] = ()

    def highest(self) -> int:
        """The highest index used; -1 if there is none."""
        return max((i for field in fields(self) for i in getattr(self, field.name)), default=-1)


@dataclass(frozen=True, eq=False)
class Cell:
    """A Cell has n states, q drives, H units, m static features, R factors, p values.

    They are arrays of numpy, in a network float32, or tensors of torch, while it is fitted.

    Attributes:
        a: A, shape (n, n).
        b: B, shape (n, q).
        e: E, shape (n, H).
        w: W, shape (H, n + q + 1), its columns in the order [x, f, 1]; of gated units
            (H, n_schedule + 1), [s, 1]. A fit without constant terms leaves the last one out.
        c: C, shape (p R, n), the R rows of a value together.
        d: D, shape (p R, m).
        d0: shape (p R,).
        activation: one of ``CELL_ACTIVATIONS``; without units (H = 0) the cell is linear.
        v: V of gated units, shape (H, n + n_gated), [x, g]; else None.
        substeps: in every sample the states take so many steps, under the same features. A spring
            that hardens is a cube in a short step, and no longer one in a long step.
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
        """It is true when the units are gated: the cell is linear parameter-varying (LPV)."""
        return self.activation == GATED

    def arrays(self) -> dict[str, Array]:
        """Give the matrices by name, in the order of their bytes."""
        names = ("a", "b", "e", "w", *(["v"] if self.v is not None else []), "c", "d", "d0")
        return {name: getattr(self, name) for name in names}

    def with_arrays(self, arrays: Mapping[str, Array]) -> Cell:
        """Give the cell with other matrices, by name."""
        return replace(self, **cast("Any", arrays))


def in_double(cell: Cell) -> Cell:
    """Give the cell with its weights in double precision."""
    return cell.with_arrays({n: array.astype(np.float64) for n, array in cell.arrays().items()})


def cell_shapes(
    roles: Roles, activation: str, n: int, units: int, rows: int, bias: bool = True
) -> dict[str, tuple[int, ...]]:
    """Give the shapes of a cell's matrices by name, in the order of their bytes.

    Gated units have a V. C has p R rows. Without ``bias`` there are no constant terms: neither the
    last column of W nor d0.
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
    """Reject a cell of wrong shapes or weights, or roles that ``n_signals`` features do not have.

    Raises:
        ValueError: with the numbers found and expected: a shape is another one, a weight not
            float32 or not finite, the activation unknown, or a feature of a role not there.
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
            f"with {cell.activation} units; expected them for gated units alone"
        )


def _check_kind(cell: Cell) -> None:
    """Reject an unknown activation, a wrong number of sub-steps, and a V that does not fit.

    Raises:
        ValueError: with what was found and expected.
    """
    if cell.activation not in CELL_ACTIVATIONS:
        raise ValueError(
            f"cell: activation {cell.activation!r}; expected one of {list(CELL_ACTIVATIONS)}"
        )
    if not 1 <= cell.substeps <= MOST_SUBSTEPS:
        raise ValueError(f"cell: {cell.substeps} sub-steps; expected 1 to {MOST_SUBSTEPS}")
    if (cell.v is not None) != cell.gated:
        raise ValueError(
            f"cell: activation {cell.activation!r} and v {'is' if cell.gated else 'not'} "
            "missing; expected v for gated units alone"
        )
