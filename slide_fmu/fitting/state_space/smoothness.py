"""A penalty keeps the weights of a cell from following physical parameters more than data ask for.

A few specimens, as those of measured records, determine the polynomials of the weights where they
lie, but a cell has many directions in which its outputs hardly change: between the specimens it
may be any other. The penalty draws all coefficients but the constant ones towards zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.normal_equations import NormalEquations

FEW = 8
"""Parameters of at least so many different values for each term need no penalty."""
CHANGE = 1e-2
"""A coefficient of 1 counts as much as this RMS error of the outputs' scale."""


@dataclass(frozen=True)
class Smoothness:
    """The penalty is weight * sum of the squares of all coefficients but the constant ones.

    Attributes:
        weight: 0 where there are no parameters, or values of them enough.
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
