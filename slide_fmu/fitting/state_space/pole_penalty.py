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

from slide_fmu.core.window import Window
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.normal_equations import NormalEquations

REMAINING = 0.03
"""A pole on the circle leaves this part of an initial amplitude after the truncated samples."""
ROOM = 0.5
"""Where the system's slowest pole lies outside, the circle has this part of its distance to 1."""
LARGEST_RADIUS = 0.999
"""The circle's radius is at most this, however long the window."""


@dataclass(frozen=True)
class PolePenalty:
    """The penalty is weight * sum over all poles of max(0, |pole| - radius)^2.

    Attributes:
        radius: radius of the circle.
        weight: weight of the penalty: the number of residuals, so that a pole 0.01 outside counts
            as an RMS error of 0.01 of the outputs' scale.
    """

    radius: float
    weight: float

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
        excess = pole_radii(shape, theta) - self.radius
        return self.weight * float(excess.clamp_min(0).square().sum())

    def join(
        self, normal: NormalEquations, shape: CellShape, theta: torch.Tensor
    ) -> NormalEquations:
        """Add the penalty to normal equations, with residuals sqrt(weight) (|pole| - radius).

        The derivative of a simple pole is u^H dA v / (u^H v), with its left and right eigenvectors
        u and v.
        """
        n = shape.n_states
        values, right = torch.linalg.eig(shape.split(theta).a)
        radii = values.abs()
        outside = radii > self.radius
        if not bool(outside.any()):
            return normal
        left = torch.linalg.inv(right)  # rows are u^H / (u^H v)
        slopes = left[outside][:, :, None] * right.T[outside][:, None, :]
        # d|pole| = Re(conj(pole) / |pole| dpole)
        phase = (values[outside].conj() / radii[outside])[:, None, None]
        rows = theta.new_zeros(int(outside.sum()), shape.n_parameters)
        of_f = rows[:, : shape.sizes[0]].view(len(rows), n, shape.n_next)
        of_f[:, :, :n] = (phase * slopes).real
        excess = radii[outside] - self.radius
        return NormalEquations(
            normal.cost + self.weight * float(excess.square().sum()),
            normal.matrix + self.weight * rows.T @ rows,
            normal.gradient + self.weight * rows.T @ excess,
        )


def pole_radii(shape: CellShape, theta: torch.Tensor) -> torch.Tensor:
    """Return the absolute values of the eigenvalues of A, shape (n_states,), at theta (P,)."""
    poles: torch.Tensor = torch.linalg.eigvals(shape.split(theta).a)
    return poles.abs()
