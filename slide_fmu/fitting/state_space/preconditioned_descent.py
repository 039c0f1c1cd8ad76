"""Large cells are fitted by gradient steps, preconditioned by a Gauss-Newton matrix.

With many parameters the normal equations of every step cost too much, and hold for small steps
only. Here the matrix comes from a part of the segments, is kept for a stretch of steps, and scales
the gradients of large random batches: natural gradient descent (Amari, 1998) with momentum.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch

from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.normal_equations import normal_equations
from slide_fmu.fitting.state_space.penalties import pole_radii
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.training import SEED_STRIDE

MATRIX_ROWS = 40
"""The segments that the matrix is made of have about this many residuals for each parameter."""
KEPT = 0.5
"""The matrix of the stretch before has this share in a new one."""
BATCH = 512
"""One gradient is that of this many segments."""
STRETCH = 80
"""This many steps use the same matrix; after each stretch the validation decides how to go on."""
RATE, MOMENTUM = 0.08, 0.8
"""A step is multiplied by this rate, and the running sum of the steps by this momentum."""
RECOVERY = 1.2
"""A rate that was halved grows by this factor in every stretch without failure."""
DAMPING = 0.005
"""This part of the diagonal is added to it, so that the matrix can be factorized."""
FLOOR = 0.1
"""The same part of this share of the diagonal's mean is added: hidden units that act on nothing
have no curvature."""
FAILED = 1.5
"""A validation error of this many times the best one sends the fit back to the best weights."""


@dataclass(frozen=True, eq=False)
class Descent:
    """A descent says where a fit stands between two stretches.

    Attributes:
        theta: parameters, shape (P,).
        momentum: running sum of the steps, shape (P,).
        best: parameters of the best validation so far, shape (P,).
        best_error: their validation error.
        matrix: Gauss-Newton matrix per residual, shape (P, P); None before the first stretch.
        rate: factor on the steps, halved after a failure.
        stretch: number of stretches done.
        history: (stretch, training error, validation error) after every stretch.
    """

    theta: torch.Tensor
    momentum: torch.Tensor
    best: torch.Tensor
    best_error: float
    matrix: torch.Tensor | None = None
    rate: float = RATE
    stretch: int = 0
    history: tuple[tuple[int, float, float], ...] = ()

    @property
    def finished(self) -> bool:
        """A descent is never finished early: it goes on for all its stretches."""
        return False

    @staticmethod
    def begin(theta: torch.Tensor, error: float) -> Descent:
        """Return the state before the first stretch, with the validation error there."""
        return Descent(theta, torch.zeros_like(theta), theta, error)


def advance_stretch(
    state: Descent,
    shape: CellShape,
    segments: Segments,
    validation: Callable[[torch.Tensor], float],
    radius: float,
    seed: int,
) -> Descent:
    """Do one stretch: a new matrix, then ``STRETCH`` preconditioned steps.

    A stretch that diverges, or ends far above the best validation error, is undone: the fit goes
    on from the best weights at half the rate. Poles outside of the circle of ``radius`` are
    penalised; the seed and the number of the stretch fix the batches.
    """
    generator = torch.Generator().manual_seed((seed * SEED_STRIDE + state.stretch) % 2**32)
    per_segment = segments.targets.numel() / segments.count
    count = math.ceil(MATRIX_ROWS * shape.n_parameters / per_segment)
    some = segments.chosen(_draw(segments, count, generator))
    matrix = normal_equations(shape, state.theta, some).matrix / some.targets.numel()
    if state.matrix is not None:
        matrix = KEPT * state.matrix + (1 - KEPT) * matrix
    factor = _factor(matrix)
    theta, momentum, cost, batch = state.theta, state.momentum, math.nan, segments
    for _ in range(STRETCH):
        if factor is None:
            break
        batch = segments.chosen(_draw(segments, BATCH, generator))
        cost, gradient = _gradient(shape, theta, batch, radius)
        if not math.isfinite(cost):
            break
        step = -torch.cholesky_solve(gradient[:, None], factor)[:, 0]
        momentum = MOMENTUM * momentum + state.rate * step
        theta = theta + momentum
    diverged = not math.isfinite(cost)
    error = math.inf if diverged else validation(theta)
    done = replace(state, stretch=state.stretch + 1)
    if factor is not None:
        done = replace(done, matrix=matrix, rate=min(RATE, RECOVERY * state.rate))
    if diverged or not error <= FAILED * state.best_error:  # also where it is not a number
        return replace(
            done, theta=state.best, momentum=torch.zeros_like(theta), rate=0.5 * state.rate
        )
    counted = float(batch.weights.square().mean())  # each residual counts as its weight squared
    row = (done.stretch, math.sqrt(cost / counted), error)
    done = replace(done, theta=theta, momentum=momentum, history=(*state.history, row))
    if error < state.best_error:
        return replace(done, best=theta, best_error=error)
    return done


def _draw(segments: Segments, count: int, generator: torch.Generator) -> torch.Tensor:
    """Draw the numbers of at most ``count`` segments, none twice."""
    order = torch.randperm(segments.count, generator=generator)[:count]
    return order.to(segments.features.device)


def _factor(matrix: torch.Tensor) -> torch.Tensor | None:
    """Return the Cholesky factor of the damped matrix; None where there is none."""
    diagonal = matrix.diagonal()
    damping = DAMPING * (diagonal + FLOOR * diagonal.mean())
    factor, failure = torch.linalg.cholesky_ex(matrix + torch.diag(damping))
    return None if int(failure) != 0 else factor


def _gradient(
    shape: CellShape, theta: torch.Tensor, segments: Segments, radius: float
) -> tuple[float, torch.Tensor]:
    """Return the mean square of the residuals with the penalty, and half its gradient.

    Half the gradient is J'r per residual, which belongs to the matrix J'J. It is computed in
    reverse mode: the cost does not grow with the number of parameters.
    """
    variable = theta.clone().requires_grad_()
    outputs, _ = simulate(shape, variable, segments.features)
    residuals = segments.whitened(outputs[segments.burn_in :] - segments.targets)
    cost = (segments.weights[:, None] * residuals).square().mean()
    if not math.isfinite(cost.detach()):
        return math.nan, torch.zeros_like(theta)
    cost = cost + (pole_radii(shape, variable) - radius).clamp_min(0).square().sum()
    (gradient,) = torch.autograd.grad(cost, variable)
    return float(cost.detach()), 0.5 * gradient
