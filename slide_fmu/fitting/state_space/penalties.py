"""Penalties join a fit's sum of squares: on poles, on coefficients, and towards known weights.

Far beyond the trained amplitude tanh units saturate and the cell moves as x[k+1] = A x[k] +
bounded terms. With all poles of A inside the unit circle it stays bounded for every input
(boundedness). Inside a smaller circle, whose poles decay within the truncated part of the window,
it also forgets its state there (fading memory). A penalty keeps the poles inside that circle.

A few specimens, as in measured records, determine the polynomials of the weights at these
specimens only. A cell has many directions in which its outputs hardly change, so between the
specimens it may be any other cell. A penalty draws all coefficients but the constant ones towards
zero.

Records are often short for the number of weights of a network trained on a simulation. They
determine a few of its weights well, and the noise would change all others. A prior keeps the
weights near the known ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.parameters import grid_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.levenberg_marquardt import LeastSquares
from slide_fmu.fitting.state_space.normal_equations import NormalEquations

REMAINING = 0.03
"""Fraction of an initial amplitude that a pole on the circle leaves after the truncated
samples."""
ROOM = 0.5
"""If the system's slowest pole lies outside, the circle gets this fraction of its distance to
1."""
LARGEST_RADIUS = 0.999
"""Largest radius of the circle, for windows of any length."""
BEYOND = 0.1
"""Distance beyond the ranges of physical parameters that is checked, as a share of the ranges."""
FEW = 8
"""With this number of different parameter values for each term, no penalty is needed."""
CHANGE = 1e-2
"""A coefficient of 1 costs as much as this RMS error of the outputs' scale."""
STRENGTHS = (1.0, 1e-1, 1e-2, 1e-4)
"""Strengths of the prior, one after the other: a weight that changes by its own size costs as much
as this squared error, in scaled units, summed over all samples."""


@dataclass(frozen=True)
class PolePenalty:
    """The penalty is weight * sum over all poles of max(0, |pole| - radius)^2.

    Attributes:
        radius: radius of the circle.
        weight: weight of the penalty: the number of residuals, so that a pole 0.01 outside costs
            as much as an RMS error of 0.01 of the outputs' scale.
        grid: for cells with physical parameters, values of the terms at points of their ranges,
            shape (G, terms), at each of which the penalty counts; else None.
    """

    radius: float
    weight: float
    grid: torch.Tensor | None = None

    @staticmethod
    def of(window: Window, slowest: float, residuals: int) -> PolePenalty:
        """Return the penalty for a window, whose truncated part sets the radius.

        ``slowest`` is the largest absolute value of the system's own poles, 0 if they are not
        known: the penalty must not move them, even if a recipe allows a short window.
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
        """Return the result of ``_of_cell`` for all points of the grid, by all coefficients."""
        assert self.grid is not None
        rows_of_grid = []
        for phi, weights in zip(self.grid, shape.weights(theta, self.grid), strict=True):
            excess, rows = self._of_cell(shape, weights)
            rows_of_grid.append((excess, torch.kron(phi, rows)))
        excesses, every = zip(*rows_of_grid, strict=True)
        return torch.cat(excesses), torch.cat(every)

    def _of_cell(
        self, shape: CellShape, weights: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the excess of R poles over the circle, (R,), and its derivatives by the weights.

        The derivatives have the shape (R, n_weights).
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

    Otherwise a fit may have poles outside the circle just beyond the range.
    """
    return torch.from_numpy(basis.values(grid_of(basis.parameters, BEYOND)))


def pole_radii(
    shape: CellShape, theta: torch.Tensor, grid: torch.Tensor | None = None
) -> torch.Tensor:
    """Return the absolute values of the eigenvalues of A at theta (P,), shape (n_states,).

    For cells with physical parameters, poles at all points of a grid of terms, (G, terms), are
    returned: (G, n_states).
    """
    poles: torch.Tensor = torch.linalg.eigvals(shape.split(shape.weights(theta, grid)).a)
    return poles.abs()


@dataclass(frozen=True)
class Smoothness:
    """The penalty is weight * sum of the squares of all coefficients but the constant ones.

    Attributes:
        weight: 0 if there are no parameters, or enough values of them.
    """

    weight: float

    @staticmethod
    def of(terms: FloatArray | None, residuals: int) -> Smoothness:
        """Return the penalty for the terms of all trajectories, (n_trajectories, n_terms)."""
        if terms is None:
            return Smoothness(0.0)
        different = len({tuple(row) for row in terms.tolist()})
        return Smoothness(residuals * CHANGE**2 if different < FEW * terms.shape[1] else 0.0)

    def cost(self, shape: CellShape, theta: torch.Tensor) -> float:
        """Return the value of the penalty at the parameters theta, shape (P,)."""
        return self.weight * float(theta[shape.n_weights :].square().sum())

    def join(
        self, normal: NormalEquations, shape: CellShape, theta: torch.Tensor
    ) -> NormalEquations:
        """Add the penalty to normal equations."""
        if not self.weight:
            return normal
        follows = torch.ones_like(theta)
        follows[: shape.n_weights] = 0
        return NormalEquations(
            normal.cost + self.cost(shape, theta),
            normal.matrix + self.weight * torch.diag(follows),
            normal.gradient + self.weight * follows * theta,
        )


@dataclass(frozen=True, eq=False)
class Prior:
    """The prior is strength * sum over all weights of ((theta - centre) / size)^2.

    Attributes:
        centre: known weights, shape (P,).
        precision: strength / size^2, shape (P,).
    """

    centre: torch.Tensor
    precision: torch.Tensor

    @staticmethod
    def around(shape: CellShape, theta: torch.Tensor, strength: float) -> Prior:
        """Return the prior around weights (P,); sizes are from the weights and their matrix.

        Coefficients of terms of physical parameters have the sizes of the constant ones.
        """
        squares = theta[: shape.n_weights].square()
        first = 0
        for size in shape.sizes:
            part = squares[first : first + size]
            if size:
                part += part.mean().clamp_min(1e-12)
            first += size
        return Prior(theta, strength / squares.repeat(shape.terms))

    def joined(self, problem: LeastSquares) -> LeastSquares:
        """Return a least-squares problem with the prior in its sum of squares."""

        def cost(theta: torch.Tensor) -> float:
            return problem.cost(theta) + float(self.precision @ (theta - self.centre).square())

        def normal(theta: torch.Tensor) -> NormalEquations:
            equations, apart = problem.normal(theta), theta - self.centre
            return NormalEquations(
                equations.cost + float(self.precision @ apart.square()),
                equations.matrix + torch.diag(self.precision),
                equations.gradient + self.precision * apart,
            )

        return LeastSquares(normal, cost, problem.count, problem.validation)
