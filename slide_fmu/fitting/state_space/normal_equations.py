"""A cell's sum of squares, gradient and Gauss-Newton matrix come from forward sensitivities.

S[k] = dx[k]/dtheta follows S[k+1] = (A + E act' W_x) S[k] + df/dtheta along the segments (LPV
units: A + T E diag(gates) V_x T'). The states, the hidden units and their slopes come from
``slide_fmu.network.state_space.equations``. J'J and J'r are accumulated over blocks of samples, so
that J itself is never stored. If there are far more residuals than parameters, J'J is taken from
every second, fourth or eighth sample and scaled, since neighbours are nearly the same. The
gradient, which decides where a fit ends, uses all samples.

With physical parameters, the weights of a segment's cell are sum over k of phi_k Theta_k. So its
rows of J by the cells of coefficients are phi_k times the rows by its own weights: J'J is the sum
over the segments b of (phi_b phi_b') kron J_b'J_b. The sensitivities, which cost most, are those
of one cell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import final

import torch

from slide_fmu.fitting.state_space.amounts import THINNEST
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.network.state_space.equations import ByRole, Equations, HiddenUnits, outputs, turned

SENSITIVITIES = {"cpu": 150_000, "cuda": 100_000_000}
"""Size of the sensitivities of one chunk of segments, by device: about a core's cache, or enough
to keep a GPU busy."""
BLOCK = 16
"""Number of samples whose rows of J are multiplied at once."""
ROWS_PER_PARAMETER = 50
"""Smallest number of residuals in J'J for each parameter, if there are enough."""


@dataclass(eq=False)
class NormalEquations:
    """NormalEquations have a sum of squares, J'J (P, P) and J'r (P,) over scored samples."""

    cost: float
    matrix: torch.Tensor
    gradient: torch.Tensor

    def add(self, rows: torch.Tensor, residuals: torch.Tensor, thin: int) -> None:
        """Add rows of J (samples, B, p, P), each ``thin``-th to J'J, and residuals."""
        flat, residual = rows.reshape(-1, rows.shape[-1]), residuals.reshape(-1)
        some = rows[::thin]
        share = len(rows) / len(some)
        some = some.reshape(-1, rows.shape[-1])
        self.matrix.addmm_(some.T, some, alpha=share)
        self.gradient.addmv_(flat.T, residual)
        self.cost += float(residual @ residual)


def sum_of_squares(shape: CellShape, theta: torch.Tensor, segments: Segments) -> float:
    """Return the sum of squares over all scored samples; not finite if the cell diverges."""
    return float(squares_of_segments(shape, theta, segments) @ segments.weights.square())


def squares_of_segments(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Return the sum of squares over the scored samples of each segment, (B,), without weights.

    It is not finite if the cell diverges.
    """
    with torch.no_grad():
        outputs, _ = simulate(shape, theta, segments.features, segments.phi, segments.initial)
        residuals = segments.whitened(outputs[segments.burn_in :] - segments.targets)
        squares: torch.Tensor = residuals.square().sum((0, 2))
        return squares


def normal_equations(shape: CellShape, theta: torch.Tensor, segments: Segments) -> NormalEquations:
    """Accumulate the normal equations of a least-squares step at theta, shape (n_parameters,)."""
    with torch.no_grad():
        if segments.phi is not None:
            return _of_coefficients(shape, theta, segments, segments.phi.shape[1])
        count, thin = shape.n_parameters, thinning(shape, segments)
        total = NormalEquations(0.0, theta.new_zeros(count, count), theta.new_zeros(count))
        for chunk in _chunks(shape, segments):
            _run(shape, theta, chunk, partial(total.add, thin=thin))
        return total


def _of_coefficients(
    shape: CellShape, theta: torch.Tensor, segments: Segments, n_terms: int
) -> NormalEquations:
    """Accumulate the normal equations of a cell whose weights follow physical parameters."""
    thin, n_weights, cost = thinning(shape, segments), shape.n_weights, 0.0
    blocks = theta.new_zeros(n_terms**2, n_weights**2)  # blocks of J'J, for each pair of terms
    gradient = torch.zeros_like(theta)
    for chunk in _chunks(shape, segments):
        of_each, phi = _EachSegment(thin), chunk.phi
        assert phi is not None
        _run(shape, shape.weights(theta, phi), chunk, of_each.add)
        different, products = of_each.products(phi)
        factors = (different[:, :, None] * different[:, None, :]).flatten(1)
        blocks.addmm_(factors.T, products.flatten(1))
        gradient += of_each.gradient(phi)
        cost += of_each.cost
    apart = blocks.view(n_terms, n_terms, n_weights, n_weights)
    return NormalEquations(cost, apart.transpose(1, 2).reshape(len(theta), -1), gradient)


def _chunks(shape: CellShape, segments: Segments) -> list[Segments]:
    """Split segments so that the sensitivities of a chunk have a suitable size."""
    numbers = SENSITIVITIES[segments.targets.device.type]
    return segments.chunks(max(8, numbers // (shape.n_states * shape.n_dynamic)))


def thinning(shape: CellShape, segments: Segments) -> int:
    """Return t such that every t-th sample in J'J gives enough rows for the parameters."""
    thin, enough = 1, 2 * ROWS_PER_PARAMETER * shape.n_parameters
    while thin < THINNEST and segments.targets.numel() >= enough * thin:
        thin *= 2
    return thin


@final
class _EachSegment:
    """_EachSegment has rows of J and residuals of a chunk of B segments, by segment.

    Args:
        thin: each ``thin``-th row of J is used for J'J.

    Attributes:
        cost: sum of squares.
    """

    def __init__(self, thin: int) -> None:
        self._thin = thin
        self._rows: list[torch.Tensor] = []
        self._gradients: list[torch.Tensor] = []
        self.cost = 0.0

    def add(self, rows: torch.Tensor, residuals: torch.Tensor) -> None:
        """Add rows of J (samples, B, p, n_weights), and residuals (samples, B, p)."""
        some = rows[:: self._thin]
        self._rows.append(math.sqrt(len(rows) / len(some)) * some)
        self._gradients.append(torch.einsum("sbpj,sbp->bj", rows, residuals))
        self.cost += float(residuals.square().sum())

    def products(self, phi: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the G different terms of the chunk, (G, K), and J'J of each, (G, n, n).

        Segments of one trajectory have the same terms, (B, K), and share one product, which saves
        most of the memory.
        """
        different, group = torch.unique(phi, dim=0, return_inverse=True)
        rows = torch.cat(self._rows).transpose(0, 1).flatten(1, 2)  # (B, rows, n_weights)
        parts = [rows[group == g].flatten(0, 1) for g in range(len(different))]
        return different, torch.stack([part.T @ part for part in parts])

    def gradient(self, phi: torch.Tensor) -> torch.Tensor:
        """Return J'r by all coefficients, for terms (B, K): shape (K n_weights,)."""
        return (phi.T @ torch.stack(self._gradients).sum(0)).flatten()


class _Rows:
    """_Rows of J are filled for a block of samples, with views on each output's parameters."""

    def __init__(self, shape: CellShape, theta: torch.Tensor, batch: int) -> None:
        p, factors = shape.n_outputs, shape.n_factors
        self.rows = theta.new_zeros(BLOCK, batch, p, shape.n_weights)
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
        """Fill the next row of C, D and d: the products of all factors with x, w and 1.

        The parts x, w and 1 have the shape (B, ...) each; the weighted factors [1, r] have (B, R).
        """
        for own, part in zip(self.own, parts, strict=True):
            if own is not None:
                own[self.filled] = (factors[:, :, None] * part[:, None, :])[..., None]

    def take(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the filled rows and residuals; the block is empty again."""
        count, self.filled = self.filled, 0
        return self.rows[:count], self.residuals[:count]


class _Sensitivities:
    """_Sensitivities are S = dx/dtheta of a chunk, (B, n, n_dynamic), and their recursion."""

    def __init__(
        self, shape: CellShape, equations: Equations, initial: torch.Tensor | None
    ) -> None:
        cell, inputs = equations.cell, equations.inputs
        self._shape, self._equations, self._inputs = shape, equations, inputs
        self._a, self._e = cell.a.contiguous(), cell.e.contiguous()
        # inputs of W other than the states: [f, 1], in LPV units [s, 1]
        seen = inputs.schedule if shape.gated else inputs.drive
        one = seen.new_ones(*seen.shape[:2], 1)
        self._arguments = torch.cat([seen, one], 2) if shape.bias else seen
        batch = inputs.drive.shape[1]
        self.state = cell.a.new_zeros(batch, shape.n_states) if initial is None else initial
        self.values = cell.a.new_zeros(batch, shape.n_states, shape.n_dynamic)
        self._next = torch.empty_like(self.values)
        if shape.turned:
            self._blocks = self._turns()

    def _turns(self) -> torch.Tensor:
        """Return the matrices that turn a pair of states, shape (N, B, 2, 2)."""
        turn = self._inputs.turn
        frames = torch.eye(2, dtype=turn.dtype, device=turn.device).expand(*turn.shape, 2)
        matrices: torch.Tensor = turned(frames, turn[:, :, None], 1, torch).mT
        return matrices

    def advance(self, k: int) -> None:
        """Take a step in sample k."""
        units = self._equations.hidden_units_with_slopes(k, self.state)
        slopes, terms = (self._gated if self._shape.gated else self._plain)(k, units)
        torch.bmm(self._a + slopes, self.values, out=self._next)
        self.values, self._next = self._next, self.values
        linear = torch.cat([self.state, self._inputs.drive[k]], 1)
        self._add_direct(k, linear, units.values)
        first = self._shape.sizes[0]
        for gain, arguments in terms:
            size = gain.shape[2] * arguments.shape[1]
            part = self.values[..., first : first + size]
            part.view(*gain.shape, arguments.shape[1]).add_(
                gain[..., None] * arguments[:, None, None, :]
            )
            first += size
        self.state = self._equations.after(k, self.state, units.values)

    def _add_direct(self, k: int, linear: torch.Tensor, units: torch.Tensor) -> None:
        """Add the direct effect of F on the next state: of A and B directly, of E through T."""
        shape, (batch, n) = self._shape, self.values.shape[:2]
        of_f = self.values[..., : shape.sizes[0]].view(batch, n, n, shape.n_next)
        before, pairs = linear.shape[1], shape.turned
        of_f[..., :before].diagonal(dim1=1, dim2=2).add_(linear[..., None])
        rest = of_f[:, 2 * pairs :, 2 * pairs :, before:]
        rest.diagonal(dim1=1, dim2=2).add_(units[..., None])
        if pairs:
            of_e = of_f[:, : 2 * pairs, : 2 * pairs, before:]
            of_pairs = of_e.unflatten(2, (pairs, 2)).unflatten(1, (pairs, 2))
            own = of_pairs.diagonal(dim1=1, dim2=3)  # (B, 2, 2, H, pairs)
            own.add_((self._blocks[k][..., None] * units[:, None, None, :])[..., None])

    def _plain(self, k: int, units: HiddenUnits) -> _Step:
        """Return the step of hidden units on states and state input."""
        arguments = torch.cat([self.state, self._arguments[k]], 1)
        gain = self._e * units.slope[:, None, :]
        return gain @ self._equations.w_x, [(gain, arguments)]

    def _gated(self, k: int, units: HiddenUnits) -> _Step:
        """Return the step of LPV units, which act in the turned frame."""
        v_x, turn, pairs = self._equations.v_x, self._inputs.turn[k], self._shape.turned
        assert v_x is not None
        assert units.gates is not None
        assert units.seen is not None
        count, turn = len(turn), turn[:, None]
        acting = turned(self._e.mT.expand(count, -1, -1), turn, pairs, torch).mT.contiguous()
        gain = acting * units.gates[:, None, :]
        # V T': the transpose of T acting on the rows of V
        seeing = turned(v_x.expand(count, -1, -1), turn, pairs, torch)
        offered = torch.cat([units.seen, self._inputs.gated[k]], 1)
        terms = [(acting * units.slope[:, None, :], self._arguments[k]), (gain, offered)]
        return torch.bmm(gain, seeing), terms


_Step = tuple[torch.Tensor, list[tuple[torch.Tensor, torch.Tensor]]]
"""For one sample: the hidden units' part of dx'/dx (B, n, n); and for W, and V, the gains (B, n,
H) and the arguments (B, ...) whose products are dx'/dW and dx'/dV."""


def _run(
    shape: CellShape,
    weights_of_cells: torch.Tensor,
    chunk: Segments,
    add: Callable[[torch.Tensor, torch.Tensor], None],
) -> None:
    """Run a chunk of segments with its sensitivities, and add its rows, block by block.

    The rows of J are derivatives by the weights of the cell, (n_weights,), or of one cell for each
    segment, (B, n_weights).
    """
    theta = weights_of_cells
    if chunk.whitening is not None:
        add = chunk.whitening.streamed(add)
    cell, burn_in, samples = shape.split(theta), chunk.burn_in, len(chunk.features)
    inputs = ByRole.of(shape.roles, chunk.features)
    equations = Equations(cell, inputs, shape.turned, torch)
    rows, weights = _Rows(shape, theta, chunk.count), chunk.weights[:, None]
    sensitivities = _Sensitivities(shape, equations, chunk.initial)
    states, one = [], theta.new_ones(chunk.count, 1)
    for k in range(samples):
        for _ in range(shape.substeps):
            sensitivities.advance(k)
        if k < burn_in:
            continue
        factors = weights * torch.cat([one, inputs.readout[k]], 1)
        rows.dynamic[rows.filled] = _to_outputs(cell.c, factors) @ sensitivities.values
        rows.fill_own((sensitivities.state, inputs.static[k], one), factors)
        states.append(sensitivities.state)
        rows.filled += 1
        if rows.filled == BLOCK or k + 1 == samples:
            block = slice(k + 1 - rows.filled, k + 1)
            of_block = outputs(cell, torch.stack(states), inputs.part(block))
            targets = chunk.targets[block.start - burn_in : block.stop - burn_in]
            rows.residuals[: rows.filled] = weights * (of_block - targets)
            add(*rows.take())
            states = []


def _to_outputs(c: torch.Tensor, factors: torch.Tensor) -> torch.Tensor:
    """Return dy/dx times the weights, shape (B, p, n)."""
    count = factors.shape[1]
    if count == 1:
        return factors[:, :, None] * c
    shares = c.reshape(*c.shape[:-2], -1, count, c.shape[-1])
    return torch.einsum("br,prn->bpn" if c.ndim == 2 else "br,bprn->bpn", factors, shares)
