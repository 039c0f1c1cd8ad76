"""The cell equation, once, for numpy arrays and torch tensors alike.

    x[k+1] = A x[k] + B f[k] + T[k] E h[k]
    y[k+1] = sum over r in [1, r[k]] of r (C_r x[k+1] + D_r w[k] + d_r)
    h[k]   = act(W_x x[k] + W_f f[k] + w_1),  or of gated units
    h[k]   = tanh(W_f s[k] + w_1) * (V_x T[k]' x[k] + V_g g[k])

A cell with sub-steps moves its states several times in each sample, by the same features; the
values come after the last time.

The features f, w, s, g, r of a sample, and cosine and sine of the turn T, come by their roles
(``Roles``). T turns the first pairs of states out of the frame in which gated units act. The
class of models is the nonlinear state space of system identification (Paduart et al., 2010, with
polynomial units); with gated units it is a linear parameter-varying one.

``Equations`` holds what does not depend on the states, for all samples at once. Everything that
moves a cell asks it: the evaluation in numpy (``network.py``), its gradient (``gradient.py``), and
the fits in torch (``slide_fmu.fitting.state_space``). The C runtime has its own copy
(``runtime/kernel/kernel.c``), the tests an independent one in plain loops
(``tests/plain_cell.py``).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from slide_fmu.network.activations import ACTIVATIONS, MIXED, Activation, Array, Namespace
from slide_fmu.network.state_space.cell import GATED, MIXED_UNITS, Cell, Roles


@dataclass(frozen=True, eq=False)
class ByRole:
    """Features along sequences by their roles, shape (N, B, ...): the sample first.

    Attributes:
        drive: f. static: w. gated: g. schedule: s. readout: r. turn: cosine and sine, or none.
    """

    drive: Array
    static: Array
    gated: Array
    schedule: Array
    readout: Array
    turn: Array

    @staticmethod
    def of(roles: Roles, features: Array) -> ByRole:
        """Pick the features of every role out of all of them, shape (N, B, n_features)."""
        every = tuple(range(features.shape[2]))
        found: dict[tuple[int, ...], Array] = {every: features}
        for field in fields(roles):
            indices = getattr(roles, field.name)
            if indices not in found:
                found[indices] = features[:, :, list(indices)]
        return ByRole(**{field.name: found[getattr(roles, field.name)] for field in fields(roles)})

    def stretch(self, samples: slice) -> ByRole:
        """Give the features of a stretch of the samples."""
        return ByRole(**{field.name: getattr(self, field.name)[samples] for field in fields(self)})


@dataclass(frozen=True, eq=False)
class Units:
    """The units of one sample, and how they move; shapes (B, H), of ``seen`` (B, n).

    Attributes:
        values: h.
        slope: dh by the arguments of the activation, W_x x + W_f f + w_1.
        gates: of gated units, dh by what V offers to them; else None.
        seen: of gated units, the states in their frame, T' x; else None.
    """

    values: Array
    slope: Array
    gates: Array | None = None
    seen: Array | None = None


class Equations:
    """The cell along given features, whatever its states. Final.

    Args:
        cell: the matrices; or those of one cell for each sequence, with an axis (B,) before.
        inputs: the features by role, N samples of B sequences.
        turned: number of pairs of states, the first ones, that gated units see turned.
        xp: ``numpy`` or ``torch``, to which matrices and inputs belong.

    Attributes:
        w_x: W_x, shape (H, n); None of gated units.
        w_f: W_f, shape (H, q), of gated units (H, n_schedule).
        v_x: V_x of gated units, shape (H, n); else None.
        v_g: V_g of gated units, shape (H, n_gated); else None.
    """

    def __init__(self, cell: Cell, inputs: ByRole, turned: int, xp: Namespace) -> None:
        self.cell, self.inputs, self.turned, self._xp = cell, inputs, turned, xp
        self._activation = _ACTIVATIONS.get(cell.activation) or ACTIVATIONS[cell.activation]
        # torch has product and sum in one, for plain matrices
        self._addmm = getattr(xp, "addmm", None) if cell.a.ndim == 2 else None
        n = cell.a.shape[-1]
        seen, first = (inputs.schedule, 0) if cell.gated else (inputs.drive, n)
        last = first + seen.shape[-1]
        self.w_x = None if cell.gated else cell.w[..., :n]
        self.w_f, constant = cell.w[..., first:last], cell.w[..., last:]
        self.v_x = None if cell.v is None else cell.v[..., :n]
        self.v_g = None if cell.v is None else cell.v[..., n:]
        arguments = times(seen, self.w_f)
        self._arguments = arguments + constant[..., 0] if constant.shape[-1] else arguments
        self._driven = times(inputs.drive, cell.b)
        if self.v_g is not None:
            self._gates = self._activation.value(self._arguments, xp)
            self._offered = times(inputs.gated, self.v_g)

    def run(self, state: Array) -> Array:
        """Give the states after all samples, (N, B, n), from those before them, (B, n)."""
        substeps = self.cell.substeps
        return self.path(state)[substeps - 1 :: substeps]

    def path(self, state: Array) -> Array:
        """Give the states after all sub-steps of all samples, (N substeps, B, n)."""
        states = []
        for k in range(len(self._driven)):
            for _ in range(self.cell.substeps):
                state = self.after(k, state, self.units(k, state))
                states.append(state)
        return self._xp.stack(states)

    def units(self, k: int, state: Array) -> Array:
        """Give the units h at sample k, (B, H), from the states before it, (B, n)."""
        if self.cell.gated:
            return self._gates[k] * self._products(k, self._seen(k, state))
        return self._activation.value(self._plain_arguments(k, state), self._xp)

    def units_with_slopes(self, k: int, state: Array) -> Units:
        """Give what ``units`` gives, with what reverse mode and sensitivities need of it."""
        if self.cell.gated:
            gates, seen = self._gates[k], self._seen(k, state)
            products = self._products(k, seen)
            slope = products * self._activation.slope(self._arguments[k], gates, self._xp)
            return Units(gates * products, slope, gates, seen)
        arguments = self._plain_arguments(k, state)
        values = self._activation.value(arguments, self._xp)
        return Units(values, self._activation.slope(arguments, values, self._xp))

    def after(self, k: int, state: Array, units: Array) -> Array:
        """Give the states after a step in sample k, (B, n), from those before and their units."""
        moved = self._plus(self._driven[k], state, self.cell.a)
        if self.turned == 0:
            return self._plus(moved, units, self.cell.e)
        pushed = times(units, self.cell.e)
        return moved + turned(pushed, self.inputs.turn[k], self.turned, self._xp)

    def _plain_arguments(self, k: int, state: Array) -> Array:
        assert self.w_x is not None
        return self._plus(self._arguments[k], state, self.w_x)

    def _seen(self, k: int, state: Array) -> Array:
        return turned(state, self.inputs.turn[k], self.turned, self._xp, back=True)

    def _products(self, k: int, seen: Array) -> Array:
        assert self.v_x is not None
        return self._plus(self._offered[k], seen, self.v_x)

    def _plus(self, constant: Array, vectors: Array, matrix: Array) -> Array:
        if self._addmm is None:
            return times(vectors, matrix) + constant
        return self._addmm(constant, vectors, matrix.T)


_ACTIVATIONS: dict[str, Activation] = {GATED: ACTIVATIONS["tanh"], MIXED_UNITS: MIXED}
"""What units have that are not called like their activation."""


def times(vectors: Array, matrix: Array) -> Array:
    """Multiply vectors (..., B, n) by a matrix (m, n), or by one for each of B, (B, m, n)."""
    if matrix.ndim == 2:
        return vectors @ matrix.T
    return (matrix @ vectors[..., None])[..., 0]


def outputs(cell: Cell, states: Array, inputs: ByRole) -> Array:
    """Give the values y, (N, B, p), from the states after the samples, (N, B, n)."""
    parts = rows(cell, states, inputs.static)
    factors = inputs.readout.shape[-1]
    if factors == 0:
        return parts
    shares = parts.reshape(*parts.shape[:-1], -1, 1 + factors)
    return shares[..., 0] + (shares[..., 1:] * inputs.readout[..., None, :]).sum(-1)


def rows(cell: Cell, states: Array, static: Array) -> Array:
    """Give the sums C_r x + D_r w + d_r, (..., p R), of states (..., n) and w (..., m).

    Of one cell for each sequence, the axis before the last is that of the sequences.
    """
    return times(states, cell.c) + times(static, cell.d) + cell.d0


def turned(vectors: Array, turn: Array, pairs: int, xp: Namespace, *, back: bool = False) -> Array:
    """Turn the first pairs of components of vectors, shape (..., n), by an angle.

    ``turn`` is its cosine and sine, shape (..., 2); ``back`` turns by the opposite angle, which is
    the transpose of the matrix. No pairs leave the vectors as they are.
    """
    if pairs == 0:
        return vectors
    first, rest = vectors[..., : 2 * pairs], vectors[..., 2 * pairs :]
    x, y = first[..., 0::2], first[..., 1::2]
    c, s = turn[..., :1], -turn[..., 1:] if back else turn[..., 1:]
    moved = xp.stack([c * x - s * y, s * x + c * y], -1).reshape(first.shape)
    return xp.concat([moved, rest], -1)
