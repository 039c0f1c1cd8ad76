"""The cell equation is written once, for numpy arrays and torch tensors alike.

    x[k+1] = A x[k] + B f[k] + T[k] E h[k]
    y[k+1] = sum over r in [1, r[k]] of r (C_r x[k+1] + D_r w[k] + d_r)
    h[k]   = act(W_x x[k] + W_f f[k] + w_1),  or with gated units
    h[k]   = tanh(W_f s[k] + w_1) * (V_x T[k]' x[k] + V_g g[k])

A cell with sub-steps moves its states several times in each sample, with the same features; the
values are computed after the last sub-step.

The features f, w, s, g, r of a sample, and cosine and sine of the turn T, are selected by their
roles (``Roles``). T turns the first pairs of states out of the frame in which gated units act. The
class of models is the nonlinear state space of system identification (Paduart et al., 2010, with
polynomial units); with gated units it is linear parameter-varying.

``Equations`` computes once, for all samples, what does not depend on the states. All code that
runs a cell uses it: the evaluation in numpy (``network.py``), its gradient (``gradient.py``), and
the fits in torch (``slide_fmu.fitting.state_space``). The C runtime has its own copy
(``runtime/kernel/kernel.c``); the tests have an independent one in plain loops
(``tests/plain_cell.py``).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import final

from slide_fmu.network.activations import ACTIVATIONS, MIXED, Activation, Array, Namespace
from slide_fmu.network.state_space.cell import GATED, MIXED_UNITS, Cell, Roles


@dataclass(frozen=True, eq=False)
class ByRole:
    """A ByRole holds features along sequences by role, shape (N, B, ...): the sample first.

    Attributes:
        drive: f. static: w. gated: g. schedule: s. readout: r. turn: cosine and sine, or empty.
    """

    drive: Array
    static: Array
    gated: Array
    schedule: Array
    readout: Array
    turn: Array

    @staticmethod
    def of(roles: Roles, features: Array) -> ByRole:
        """Pick the features of every role from all features, shape (N, B, n_features)."""
        every = tuple(range(features.shape[2]))
        picked: dict[tuple[int, ...], Array] = {every: features}
        for field in fields(roles):
            indices = getattr(roles, field.name)
            if indices not in picked:
                picked[indices] = features[:, :, list(indices)]
        return ByRole(
            **{field.name: picked[getattr(roles, field.name)] for field in fields(roles)}
        )

    def part(self, samples: slice) -> ByRole:
        """Return the features of some of the samples."""
        return ByRole(**{field.name: getattr(self, field.name)[samples] for field in fields(self)})


@dataclass(frozen=True, eq=False)
class HiddenUnits:
    """HiddenUnits holds h of one sample and its slopes; shapes (B, H), ``seen`` (B, n).

    Attributes:
        values: h.
        slope: dh by the arguments of the activation, W_x x + W_f f + w_1.
        gates: for gated units, dh by the products of V; else None.
        seen: for gated units, the states in their frame, T' x; else None.
    """

    values: Array
    slope: Array
    gates: Array | None = None
    seen: Array | None = None


@final
class Equations:
    """Equations evaluate the cell along given features, from any states.

    Args:
        cell: the matrices of one cell; or of one cell for each sequence, with an axis (B,) in
            front.
        inputs: the features by role, N samples of B sequences.
        turned: number of pairs of states, from the first, that gated units see turned.
        xp: ``numpy`` or ``torch``, the namespace of matrices and inputs.

    Attributes:
        w_x: W_x, shape (H, n); None for gated units.
        w_f: W_f, shape (H, q); for gated units (H, n_schedule).
        v_x: V_x of gated units, shape (H, n); else None.
        v_g: V_g of gated units, shape (H, n_gated); else None.
    """

    def __init__(self, cell: Cell, inputs: ByRole, turned: int, xp: Namespace) -> None:
        self.cell, self.inputs, self.turned, self._xp = cell, inputs, turned, xp
        self._activation = _ACTIVATIONS.get(cell.activation) or ACTIVATIONS[cell.activation]
        # torch computes product and sum in one call, for plain matrices
        self._addmm = getattr(xp, "addmm", None) if cell.a.ndim == 2 else None
        n = cell.a.shape[-1]
        seen, first = (inputs.schedule, 0) if cell.gated else (inputs.drive, n)
        last = first + seen.shape[-1]
        self.w_x = None if cell.gated else cell.w[..., :n]
        self.w_f, constant = cell.w[..., first:last], cell.w[..., last:]
        self.v_x = None if cell.v is None else cell.v[..., :n]
        self.v_g = None if cell.v is None else cell.v[..., n:]
        arguments = times(seen, self.w_f)
        arguments = arguments + constant[..., 0] if constant.shape[-1] else arguments
        # one array for each sample: the way back of one sample of a tensor would fill all of it
        self._arguments, self._driven = list(arguments), list(times(inputs.drive, cell.b))
        if self.v_g is not None:
            self._gates = list(self._activation.value(arguments, xp))
            self._offered = list(times(inputs.gated, self.v_g))

    def run(self, state: Array) -> Array:
        """Return the states after all samples, (N, B, n), from the states before them, (B, n)."""
        substeps = self.cell.substeps
        return self.path(state)[substeps - 1 :: substeps]

    def path(self, state: Array) -> Array:
        """Return the states after all sub-steps of all samples, (N substeps, B, n)."""
        states, linear = [], self.cell.e.shape[-1] == 0
        for k in range(len(self._driven)):
            for _ in range(self.cell.substeps):
                if linear:
                    state = self._moved(k, state)
                else:
                    state = self.after(k, state, self.hidden_units(k, state))
                states.append(state)
        return self._xp.stack(states)

    def hidden_units(self, k: int, state: Array) -> Array:
        """Return the hidden units h at sample k, (B, H), from the states before it, (B, n)."""
        if self.cell.gated:
            return self._gates[k] * self._products(k, self._seen(k, state))
        return self._activation.value(self._plain_arguments(k, state), self._xp)

    def hidden_units_with_slopes(self, k: int, state: Array) -> HiddenUnits:
        """Return the hidden units with the slopes that reverse mode and sensitivities need."""
        if self.cell.gated:
            gates, seen = self._gates[k], self._seen(k, state)
            products = self._products(k, seen)
            slope = products * self._activation.slope(self._arguments[k], gates, self._xp)
            return HiddenUnits(gates * products, slope, gates, seen)
        arguments = self._plain_arguments(k, state)
        values = self._activation.value(arguments, self._xp)
        return HiddenUnits(values, self._activation.slope(arguments, values, self._xp))

    def after(self, k: int, state: Array, units: Array) -> Array:
        """Return the states after a step in sample k, (B, n), from the states before it and h."""
        moved = self._moved(k, state)
        if self.turned == 0:
            return self._plus(moved, units, self.cell.e)
        pushed = times(units, self.cell.e)
        return moved + turned(pushed, self.inputs.turn[k], self.turned, self._xp)

    def _moved(self, k: int, state: Array) -> Array:
        """Return A x + B f of sample k, (B, n)."""
        return self._plus(self._driven[k], state, self.cell.a)

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
"""Activations of the kinds of hidden units that have another name than their activation."""


def times(vectors: Array, matrix: Array) -> Array:
    """Multiply vectors (..., B, n) by a matrix (m, n), or by one for each of B, (B, m, n)."""
    if matrix.ndim == 2:
        return vectors @ matrix.T
    return (matrix @ vectors[..., None])[..., 0]


def outputs(cell: Cell, states: Array, inputs: ByRole) -> Array:
    """Return the values y, (N, B, p), from the states after the samples, (N, B, n)."""
    parts = rows(cell, states, inputs.static)
    factors = inputs.readout.shape[-1]
    if factors == 0:
        return parts
    shares = parts.reshape(*parts.shape[:-1], -1, 1 + factors)
    return shares[..., 0] + (shares[..., 1:] * inputs.readout[..., None, :]).sum(-1)


def rows(cell: Cell, states: Array, static: Array) -> Array:
    """Return the sums C_r x + D_r w + d_r, (..., p R), of states (..., n) and w (..., m).

    With one cell for each sequence, the last axis but one is the sequences' axis.
    """
    return times(states, cell.c) + times(static, cell.d) + cell.d0


def turned(vectors: Array, turn: Array, pairs: int, xp: Namespace, *, back: bool = False) -> Array:
    """Turn the first pairs of components of vectors, shape (..., n), by an angle.

    ``turn`` has its cosine and sine, shape (..., 2); ``back`` turns by the opposite angle, with
    the transposed matrix. With zero pairs the vectors stay unchanged.
    """
    if pairs == 0:
        return vectors
    first, rest = vectors[..., : 2 * pairs], vectors[..., 2 * pairs :]
    x, y = first[..., 0::2], first[..., 1::2]
    c, s = turn[..., :1], -turn[..., 1:] if back else turn[..., 1:]
    moved = xp.stack([c * x - s * y, s * x + c * y], -1).reshape(first.shape)
    return xp.concat([moved, rest], -1)
