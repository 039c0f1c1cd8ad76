"""A penalty keeps the poles of A inside the circle in which the window forgets them.

Far beyond the trained amplitude tanh units are saturated and the cell moves as x[k+1] = A x[k] +
bounded terms. With all poles of A inside the unit circle it stays bounded for every input
(boundedness); inside a circle whose poles decay within the truncated part of the window, it
forgets its state there too (fading memory). The penalty joins the sum of squares.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.parameters import grid_of
from slide_fmu.core.window import Window
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.normal_equations import NormalEquations

REMAINING = 0.03
"""A pole on the circle leaves this part of an initial amplitude after the truncated samples."""
ROOM = 0.5
"""Where the system's slowest pole lies outside, the circle has this part of its distance to 1."""
LARGEST_RADIUS = 0.999
"""The circle's radius is at most this, however long the window."""
BEYOND = 0.1
"""Physical parameters are looked at so far beyond their ranges, as a share of these."""


@dataclass(frozen=True)
class PolePenalty:
    """The penalty is weight * sum over all poles of max(0, |pole| - radius)^2.

    Attributes:
        radius: radius of the circle.
        weight: weight of the penalty: the number of residuals, so that a pole 0.01 outside counts
            as an RMS error of 0.01 of the outputs' scale.
        grid: of cells with physical parameters, values of the terms at points of their ranges,
            shape (G, terms), at each of which the penalty counts; else None.
    """

    radius: float
    weight: float
    grid: torch.Tensor | None = None

    @staticmethod
    def of(window: Window, slowest: float, residuals: int) -> PolePenalty:
        """Return the penalty for a window, whose truncated part sets the radius, and its weight.

        ``slowest`` is the largest absolute value of the system's own poles, 0 if they are not
        known: a short window, which a recipe may allow, must not hurry them.
        """
        truncated = window.n_truncated
        decayed = math.exp(math.log(REMAINING) / truncated) if truncated else LARGEST_RADIUS
        own = 1 - ROOM * (1 - slowest) if slowest > decayed else 0.0
        return PolePenalty(min(max(decayed, own), LARGEST_RADIUS), residuals)

    def cost(self, shape: CellShape, theta: torch.Tensor) -> float:
        """Return the value of the penalty at the parameters theta, shape (P,)."""
        excess = pole_radii(shape, theta, self.grid) - self.radius
        return self.weight * float(excess.clamp_min(0).square().sum())

    def join(
        self, normal: NormalEquations, shape: CellShape, theta: torch.Tensor
    ) -> NormalEquations:
        """Add the penalty to normal equations, with residuals sqrt(weight) (|pole| - radius).

        The derivative of a simple pole is u^H dA v / (u^H v), with its left and right eigenvectors
        u and v.
        """
        look = self._of_cell if self.grid is None else self._of_grid
        excess, rows = look(shape, theta)
        if len(excess) == 0:
            return normal
        return NormalEquations(
            normal.cost + self.weight * float(excess.square().sum()),
            normal.matrix + self.weight * rows.T @ rows,
            normal.gradient + self.weight * rows.T @ excess,
        )

    def _of_grid(self, shape: CellShape, theta: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what ``_of_cell`` does, of all points of the grid, by all coefficients."""
        assert self.grid is not None
        found = []
        for phi, weights in zip(self.grid, shape.weights(theta, self.grid), strict=True):
            excess, rows = self._of_cell(shape, weights)
            found.append((excess, torch.kron(phi, rows)))
        excesses, every = zip(*found, strict=True)
        return torch.cat(excesses), torch.cat(every)

    def _of_cell(
        self, shape: CellShape, weights: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return how far R poles are outside, (R,), and its derivatives by the weights of a cell.

        These have the shape (R, n_weights).
        """
        n = shape.n_states
        values, right = torch.linalg.eig(shape.split(weights).a)
        radii = values.abs()
        outside = radii > self.radius
        left = torch.linalg.inv(right)  # rows are u^H / (u^H v)
        slopes = left[outside][:, :, None] * right.T[outside][:, None, :]
        # d|pole| = Re(conj(pole) / |pole| dpole)
        phase = (values[outside].conj() / radii[outside])[:, None, None]
        rows = weights.new_zeros(int(outside.sum()), shape.n_weights)
        of_f = rows[:, : shape.sizes[0]].view(len(rows), n, shape.n_next)
        of_f[:, :, :n] = (phase * slopes).real
        return radii[outside] - self.radius, rows


def pole_grid(basis: ParameterBasis) -> torch.Tensor:
    """Return the terms at points of the parameters' ranges, and a little beyond, (G, terms).

    A fit may have poles outside the circle just beyond the range, where nobody looks.
    """
    return torch.from_numpy(basis.values(grid_of(basis.parameters, BEYOND)))


def pole_radii(
    shape: CellShape, theta: torch.Tensor, grid: torch.Tensor | None = None
) -> torch.Tensor:
    """Return the absolute values of the eigenvalues of A at theta (P,), shape (n_states,).

    Of cells with physical parameters, all at the points of a grid of terms, (G, terms):
    (G, n_states).
    """
    poles: torch.Tensor = torch.linalg.eigvals(shape.split(shape.weights(theta, grid)).a)
    return poles.abs()
