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

    def matrix(self, phi: torch.Tensor) -> torch.Tensor:
        """Return J'J by all coefficients, of terms (B, K): shape (K n_weights, K n_weights)."""
        rows = torch.cat(self._rows).transpose(0, 1).flatten(1, 2)  # (B, rows, n_weights)
        of_each = rows.mT @ rows
        factors = phi[:, :, None] * phi[:, None, :]
        count, weights = phi.shape[1], rows.shape[2]
        total = factors.flatten(1).T @ of_each.flatten(1)
        blocks = total.view(count, count, weights, weights).transpose(1, 2)
        return blocks.reshape(count * weights, count * weights)

    def gradient(self, phi: torch.Tensor) -> torch.Tensor:
        """Return J'r by all coefficients, of terms (B, K): shape (K n_weights,)."""
        return (phi.T @ torch.stack(self._gradients).sum(0)).flatten()
