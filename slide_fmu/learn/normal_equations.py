"""Sum of squares, gradient and Gauss-Newton matrix of a cell, by forward sensitivities.

S[k] = dx[k]/dtheta follows S[k+1] = (A + E act' W_x) S[k] + df/dtheta along the segments. J'J and
J'r are accumulated over blocks of samples, so that J itself is never stored. Where residuals
outnumber the parameters by far, J'J is taken from every second, fourth or eighth sample and
scaled: neighbours say nearly the same, and the gradient, which decides where a fit ends, has all.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.learn.cell import UNITS, CellShape, Matrices, simulate
from slide_fmu.learn.segments import Segments

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

    def __init__(self, shape: CellShape, theta: torch.Tensor, weights: torch.Tensor) -> None:
        batch, n, q, p = len(weights), shape.n_states, shape.n_features, shape.n_outputs
        self.rows = theta.new_zeros(BLOCK, batch, p, shape.n_parameters)
        self.residuals = theta.new_zeros(BLOCK, batch, p)
        dynamic, (_, _, c, d, _) = shape.n_dynamic, shape.sizes
        self.dynamic = self.rows[..., :dynamic]
        # rows of output i belong to row i of C, D and d0 only
        self.c = self._own(dynamic, p, n)
        self.d = self._own(dynamic + c, p, q)
        if shape.bias:
            self._own(dynamic + c + d, p, 1).copy_(weights[:, None, None])
        self.filled = 0

    def _own(self, first: int, p: int, n: int) -> torch.Tensor:
        """Of the p x n parameters from the first on, each output's own: (block, B, n, p)."""
        part = self.rows[..., first : first + p * n]
        return part.view(*part.shape[:2], p, p, n).diagonal(dim1=2, dim2=3)

    def take(self) -> tuple[torch.Tensor, torch.Tensor]:
        """The filled rows and residuals; the block is empty again."""
        count, self.filled = self.filled, 0
        return self.rows[:count], self.residuals[:count]


class _Sensitivities:
    """S = dx/dtheta of a chunk, shape (B, n, n_dynamic), and its recursion."""

    def __init__(self, shape: CellShape, m: Matrices, batch: int) -> None:
        n, q = shape.n_states, shape.n_features
        self.shape, self.m = shape, m
        self.a, self.e = m.f[:, :n].contiguous(), m.f[:, n + q :].contiguous()
        self.w = m.w[:, :n].contiguous()
        self.values = m.f.new_zeros(batch, n, shape.n_dynamic)
        self._next = torch.empty_like(self.values)

    def advance(self, arguments: torch.Tensor, terms: torch.Tensor, slope: torch.Tensor) -> None:
        """One sample on.

        Args:
            arguments: [x, f, 1], shape (B, n_arguments).
            terms: [x, f, act], shape (B, n_next).
            slope: derivative of the units, shape (B, n_units).
        """
        shape = self.shape
        gain = self.e * slope[:, None, :]
        torch.bmm(self.a + gain @ self.w, self.values, out=self._next)
        self.values, self._next = self._next, self.values
        batch, n = self.values.shape[:2]
        of_f = self.values[..., : shape.sizes[0]].view(batch, n, n, shape.n_next)
        of_f.diagonal(dim1=1, dim2=2).add_(terms[..., None])
        of_w = self.values[..., shape.sizes[0] :]
        of_w.view(batch, n, shape.n_units, shape.n_arguments).add_(
            gain[..., None] * arguments[:, None, None, :]
        )


def _run(
    shape: CellShape, theta: torch.Tensor, chunk: Segments, accumulator: _Accumulator
) -> None:
    """Run a chunk of segments with its sensitivities."""
    m, batch, burn_in = shape.split(theta), chunk.count, chunk.burn_in
    rows = _Rows(shape, theta, chunk.weights)
    weights = chunk.weights[:, None]
    weighted_c = weights[:, None] * m.c
    sensitivities = _Sensitivities(shape, m, batch)
    state = theta.new_zeros(batch, shape.n_states)
    one = theta.new_ones(batch, int(shape.bias))
    f, w, c = m.f.T.contiguous(), m.w.T.contiguous(), m.c.T.contiguous()
    for k, feature in enumerate(chunk.features):
        arguments = torch.cat([state, feature, one], 1)
        units, slope = UNITS[shape.units](arguments @ w)
        terms = torch.cat([state, feature, units], 1)
        sensitivities.advance(arguments, terms, slope)
        state = terms @ f
        if k < burn_in:
            continue
        at = rows.filled
        rows.dynamic[at] = weighted_c @ sensitivities.values
        rows.c[at] = (weights * state)[..., None]
        rows.d[at] = (weights * feature)[..., None]
        outputs = torch.addmm(m.d0, state, c) + feature @ m.d.T
        rows.residuals[at] = weights * (outputs - chunk.targets[k - burn_in])
        rows.filled += 1
        if rows.filled == BLOCK or k + 1 == len(chunk.features):
            accumulator.add(*rows.take())
