"""Sum of squares, gradient and Gauss-Newton matrix of a cell, by forward sensitivities.

S[k] = dx[k]/dtheta follows S[k+1] = (A + E act' W_x) S[k] + df/dtheta along the segments (gated
units: A + T E diag(gates) V_x T'). J'J and J'r are accumulated over blocks of samples, so that J
itself is never stored. Where residuals outnumber the parameters by far, J'J is taken from every
second, fourth or eighth sample and scaled: neighbours say nearly the same, and the gradient, which
decides where a fit ends, has all.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.learn.state_space.cell import (
    ACTIVATIONS,
    CellShape,
    Matrices,
    Sequences,
    opposite,
    simulate,
    turned,
    values,
)
from slide_fmu.learn.state_space.segments import Segments

SENSITIVITIES = {"cpu": 150_000, "cuda": 100_000_000}
"""Numbers in the sensitivities of one chunk of segments, by device: about what a core's cache
holds, or what keeps a GPU busy."""
BLOCK = 16
"""Samples whose rows of J are multiplied at once."""
ROWS_PER_PARAMETER = 50
"""Residuals for each parameter that J'J is made of, at least, where there are as many."""
THINNEST = 8
"""Samples of which at least one goes into J'J; divides ``BLOCK``."""


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Sum of squared residuals, J'J (P, P) and J'r (P,), all over all scored samples."""

    cost: float
    matrix: torch.Tensor
    gradient: torch.Tensor


def sum_of_squares(shape: CellShape, theta: torch.Tensor, segments: Segments) -> float:
    """Sum of squared residuals over all scored samples; not finite where the cell diverges."""
    with torch.no_grad():
        outputs, _ = simulate(shape, theta, segments.features)
        residuals = (outputs[segments.burn_in :] - segments.targets).square().sum((0, 2))
        return float(residuals @ segments.weights.square())


def normal_equations(shape: CellShape, theta: torch.Tensor, segments: Segments) -> NormalEquations:
    """Accumulate the normal equations of a least-squares step.

    Args:
        theta: shape (n_parameters,).
    """
    accumulator = _Accumulator(shape, theta, thinning(shape, segments))
    numbers = SENSITIVITIES[theta.device.type]
    size = max(8, numbers // (shape.n_states * shape.n_dynamic))
    with torch.no_grad():
        for chunk in segments.chunks(size):
            _run(shape, theta, chunk, accumulator)
    return NormalEquations(accumulator.cost, accumulator.matrix, accumulator.gradient)


def thinning(shape: CellShape, segments: Segments) -> int:
    """One in how many samples goes into J'J."""
    thin, enough = 1, 2 * ROWS_PER_PARAMETER * shape.n_parameters
    while thin < THINNEST and segments.targets.numel() >= enough * thin:
        thin *= 2
    return thin


class _Accumulator:
    """Sums up J'J, J'r and r'r from blocks of rows."""

    def __init__(self, shape: CellShape, theta: torch.Tensor, thin: int) -> None:
        self.cost, self._thin = 0.0, thin
        self.matrix = theta.new_zeros(shape.n_parameters, shape.n_parameters)
        self.gradient = theta.new_zeros(shape.n_parameters)

    def add(self, rows: torch.Tensor, residuals: torch.Tensor) -> None:
        """Rows of J (samples, B, p, P) and residuals (samples, B, p)."""
        flat, residual = rows.reshape(-1, rows.shape[-1]), residuals.reshape(-1)
        some = rows[:: self._thin]
        share = len(rows) / len(some)
        some = some.reshape(-1, rows.shape[-1])
        self.matrix.addmm_(some.T, some, alpha=share)
        self.gradient.addmv_(flat.T, residual)
        self.cost += float(residual @ residual)


class _Rows:
    """Rows of J of a block of samples, with views on the parts of the output's parameters."""

    def __init__(self, shape: CellShape, theta: torch.Tensor, batch: int) -> None:
        p, factors = shape.n_outputs, shape.n_factors
        self.rows = theta.new_zeros(BLOCK, batch, p, shape.n_parameters)
        self.residuals = theta.new_zeros(BLOCK, batch, p)
        self.dynamic = self.rows[..., : shape.n_dynamic]
        # rows of output i belong to block i of C, D and d only
        sizes, first = shape.sizes[3:], shape.n_dynamic
        self.own = []
        for size in sizes:
            part = self.rows[..., first : first + size]
            own = part.view(BLOCK, batch, p, p, size // p).diagonal(dim1=2, dim2=3)
            shape_of_own = (BLOCK, batch, factors, size // (p * factors), p)
            self.own.append(own.view(shape_of_own) if size else None)
            first += size
        self.filled = 0

    def fill_own(self, parts: tuple[torch.Tensor, ...], factors: torch.Tensor) -> None:
        """The next row: of C, D and d, the products of all factors with x, w and 1.

        Args:
            parts: x, w and 1, shape (B, ...) each.
            factors: [1, r], weighted, shape (B, R).
        """
        for own, part in zip(self.own, parts, strict=True):
            if own is not None:
                own[self.filled] = (factors[:, :, None] * part[:, None, :])[..., None]

    def take(self) -> tuple[torch.Tensor, torch.Tensor]:
        """The filled rows and residuals; the block is empty again."""
        count, self.filled = self.filled, 0
        return self.rows[:count], self.residuals[:count]


class _Sensitivities:
    """S = dx/dtheta of a chunk, shape (B, n, n_dynamic), with the state x, and their recursion."""

    def __init__(self, shape: CellShape, m: Matrices, sequences: Sequences) -> None:
        n, q = shape.n_states, len(shape.roles.drive)
        batch = sequences.drive.shape[1]
        self.shape, self.m, self._sequences = shape, m, sequences
        self._a, self._b = m.f[:, :n].contiguous(), m.f[:, n : n + q].T.contiguous()
        self._e = m.f[:, n + q :].contiguous()
        self.state = m.f.new_zeros(batch, n)
        self.values = m.f.new_zeros(batch, n, shape.n_dynamic)
        self._next = torch.empty_like(self.values)

    def advance(self, k: int) -> None:
        """Take in sample k."""
        step = self._gated if self.shape.gated else self._plain
        units, acting, slopes, terms = step(k)
        drive = self._sequences.drive[k]
        torch.bmm(self._a + slopes, self.values, out=self._next)
        self.values, self._next = self._next, self.values
        self._add_direct(torch.cat([self.state, drive], 1), units, acting)
        first = self.shape.sizes[0]
        for gain, arguments in terms:
            size = gain.shape[2] * arguments.shape[1]
            part = self.values[..., first : first + size]
            part.view(*gain.shape, arguments.shape[1]).add_(
                gain[..., None] * arguments[:, None, None, :]
            )
            first += size
        moved = torch.bmm(acting, units[..., None])[..., 0]
        self.state = torch.addmm(drive @ self._b, self.state, self._a.T) + moved

    def _add_direct(self, linear: torch.Tensor, units: torch.Tensor, acting: torch.Tensor) -> None:
        """What the state depends on F directly; ``acting`` is T E, shape (B, n, H)."""
        shape, (batch, n) = self.shape, self.values.shape[:2]
        of_f = self.values[..., : shape.sizes[0]].view(batch, n, n, shape.n_next)
        before = linear.shape[1]
        of_f[..., :before].diagonal(dim1=1, dim2=2).add_(linear[..., None])
        pairs = shape.turned
        rest = of_f[:, 2 * pairs :, 2 * pairs :, before:]
        rest.diagonal(dim1=1, dim2=2).add_(units[..., None])
        if pairs:
            c, s = (part[:, None] * units for part in self._turn.unbind(1))
            for first in range(0, 2 * pairs, 2):
                of_f[:, first, first, before:] += c
                of_f[:, first, first + 1, before:] -= s
                of_f[:, first + 1, first, before:] += s
                of_f[:, first + 1, first + 1, before:] += c

    def _plain(self, k: int) -> _Step:
        n = self.shape.n_states
        arguments = torch.cat([self.state, self._sequences.arguments[k]], 1)
        units, slope = ACTIVATIONS[self.shape.units](arguments @ self.m.w.T)
        gain = self._e * slope[:, None, :]
        return units, self._e.expand_as(gain), gain @ self.m.w[:, :n], [(gain, arguments)]

    def _gated(self, k: int) -> _Step:
        n, sequences, pairs = self.shape.n_states, self._sequences, self.shape.turned
        arguments, turn = sequences.arguments[k], sequences.turn[k]
        gates, slope = ACTIVATIONS["gated"](arguments @ self.m.w.T)
        offered = torch.cat([turned(self.state, opposite(turn), pairs), sequences.gated[k]], 1)
        products = offered @ self.m.v.T
        acting = _turned_rows(self._e.expand(len(turn), -1, -1), turn, pairs)
        gain = acting * gates[:, None, :]
        # V T': the transpose of T acting on the rows of V
        seen = _turned_rows(self.m.v[:, :n].T.expand(len(turn), -1, -1), turn, pairs)
        slopes = torch.bmm(gain, seen.transpose(1, 2))
        terms = [(acting * (products * slope)[:, None, :], arguments), (gain, offered)]
        self._turn = turn
        return gates * products, acting, slopes, terms


_Step = tuple[torch.Tensor, torch.Tensor, torch.Tensor, list[tuple[torch.Tensor, torch.Tensor]]]
"""Of one sample: units h (B, H); T E (B, n, H); what they add to dx'/dx (B, n, n); and for W, and
V, the gains (B, n, H) and the arguments (B, ...) whose products are dx'/dW and dx'/dV."""


def _turned_rows(matrices: torch.Tensor, turn: torch.Tensor, pairs: int) -> torch.Tensor:
    """T M of matrices M (B, n, m)."""
    if pairs == 0:
        return matrices
    first = matrices[:, : 2 * pairs].reshape(len(matrices), pairs, 2, -1)
    c, s = turn[:, :1, None], turn[:, 1:, None]
    x, y = first[:, :, 0], first[:, :, 1]
    moved = torch.stack([c * x - s * y, s * x + c * y], 2).flatten(1, 2)
    return torch.cat([moved, matrices[:, 2 * pairs :]], 1)


def _run(
    shape: CellShape, theta: torch.Tensor, chunk: Segments, accumulator: _Accumulator
) -> None:
    """Run a chunk of segments with its sensitivities."""
    m, burn_in, samples = shape.split(theta), chunk.burn_in, len(chunk.features)
    sequences = Sequences.of(shape, chunk.features)
    rows, weights = _Rows(shape, theta, chunk.count), chunk.weights[:, None]
    sensitivities = _Sensitivities(shape, m, sequences)
    states, one = [], theta.new_ones(chunk.count, 1)
    for k in range(samples):
        sensitivities.advance(k)
        if k < burn_in:
            continue
        factors = weights * sequences.factors[k]
        rows.dynamic[rows.filled] = _to_outputs(m, factors) @ sensitivities.values
        rows.fill_own((sensitivities.state, sequences.static[k], one), factors)
        states.append(sensitivities.state)
        rows.filled += 1
        if rows.filled == BLOCK or k + 1 == samples:
            block = slice(k + 1 - rows.filled, k + 1)
            outputs = values(m, torch.stack(states), sequences.chosen(block))
            targets = chunk.targets[block.start - burn_in : block.stop - burn_in]
            rows.residuals[: rows.filled] = weights * (outputs - targets)
            accumulator.add(*rows.take())
            states = []


def _to_outputs(m: Matrices, factors: torch.Tensor) -> torch.Tensor:
    """dy/dx times the weights, shape (B, p, n)."""
    if m.c.shape[1] == 1:
        return factors[:, :, None] * m.c[:, 0]
    return torch.einsum("br,prn->bpn", factors, m.c)
