"""Normal equations of cells with physical parameters: first of every segment's own cell.

The weights of a segment's cell are sum over k of phi_k Theta_k, so its rows of J by the cells of
coefficients are phi_k times those by its own weights: J'J is the sum over the segments b of
(phi_b phi_b') kron J_b'J_b. The sensitivities, which cost most, stay those of one cell.
"""

from __future__ import annotations

import math

import torch


class EachSegment:
    """The rows of J and the residuals of a chunk of B segments, by segment. Final.

    Args:
        thin: each so manyth row of J goes into J'J.

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

        Segments of one trajectory have the same terms, (B, K): theirs are one product, which
        spares most of the memory that all would take.
        """
        different, group = torch.unique(phi, dim=0, return_inverse=True)
        rows = torch.cat(self._rows).transpose(0, 1).flatten(1, 2)  # (B, rows, n_weights)
        parts = [rows[group == g].flatten(0, 1) for g in range(len(different))]
        return different, torch.stack([part.T @ part for part in parts])

    def gradient(self, phi: torch.Tensor) -> torch.Tensor:
        """Return J'r by all coefficients, of terms (B, K): shape (K n_weights,)."""
        return (phi.T @ torch.stack(self._gradients).sum(0)).flatten()


class Blocks:
    """The blocks of J'J by all coefficients, summed over the chunks. Final."""

    def __init__(self, n_terms: int, n_weights: int, like: torch.Tensor) -> None:
        self._sizes = n_terms, n_terms, n_weights, n_weights
        self._sum = like.new_zeros(n_terms**2, n_weights**2)

    def add(self, phi: torch.Tensor, products: torch.Tensor) -> None:
        """Add the products J'J of terms: (G, K), and (G, n_weights, n_weights)."""
        factors = (phi[:, :, None] * phi[:, None, :]).flatten(1)
        self._sum.addmm_(factors.T, products.flatten(1))

    def matrix(self) -> torch.Tensor:
        """Return J'J, shape (K n_weights, K n_weights)."""
        count = self._sizes[0] * self._sizes[2]
        return self._sum.view(self._sizes).transpose(1, 2).reshape(count, count)
