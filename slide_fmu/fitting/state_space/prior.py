"""A prior towards known weights: a fit changes no more of a network than its data ask for.

Records are often short beside the weights of a network that was learnt from a simulation. Of its
weights the record tells a few for sure, and the noise would move all others. The prior joins the
sum of squares as one residual for each weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.levenberg_marquardt import LeastSquares
from slide_fmu.fitting.state_space.normal_equations import NormalEquations

STRENGTHS = (1.0, 1e-1, 1e-2, 1e-4)
"""Strengths of the prior, one after the other: a weight that changes by its own size counts as
much as this squared error, in scaled units, summed over all samples."""


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
        """Return the prior around weights (P,); their sizes are those of them and their matrix.

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
            found, apart = problem.normal(theta), theta - self.centre
            return NormalEquations(
                found.cost + float(self.precision @ apart.square()),
                found.matrix + torch.diag(self.precision),
                found.gradient + self.precision * apart,
            )

        return LeastSquares(normal, cost, problem.count, problem.validation)
