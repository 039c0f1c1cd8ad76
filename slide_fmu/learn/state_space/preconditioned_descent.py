"""Large cells: gradient steps on many segments, preconditioned by a Gauss-Newton matrix.

With many parameters the normal equations of every step cost too much, and hold for small steps
only. Here they come from a part of the segments, are kept for a stretch of steps, and scale the
gradients of large random batches (natural gradient with momentum).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch

from slide_fmu.learn.state_space.cell import CellShape, simulate
from slide_fmu.learn.state_space.normal_equations import normal_equations
from slide_fmu.learn.state_space.pole_penalty import pole_radii
from slide_fmu.learn.state_space.segments import Segments
from slide_fmu.learn.training import SEED_STRIDE

MATRIX_ROWS = 40
"""Residuals for each parameter in the segments that the matrix is made of, about."""
KEPT = 0.5
"""Share of the matrix before in a new one."""
BATCH = 512
"""Segments of one gradient."""
STRETCH = 80
"""Steps with the same matrix; after each stretch the validation decides whether to go on."""
RATE, MOMENTUM = 0.08, 0.8
RECOVERY = 1.2
"""Factor on a rate that was halved, after a stretch without failure."""
DAMPING = 0.005
"""Of the diagonal, relative to itself ..."""
FLOOR = 0.1
"""... and relative to its mean: units that act on nothing yet have no curvature."""
FAILED = 1.5
"""A validation error of so many times the best one sends the fit back to the best weights."""


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a descent stands between two stretches.

    Attributes:
        theta: parameters, shape (P,).
        momentum: running sum of the steps, shape (P,).
        best: parameters of the best validation so far.
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
        """Never: a descent goes on for all its stretches."""
        return False

    @staticmethod
    def begin(theta: torch.Tensor, error: float) -> Descent:
        """Before the first stretch, with the validation error there."""
        return Descent(theta, torch.zeros_like(theta), theta, error)


def advance_stretch(
    state: Descent,
    shape: CellShape,
    segments: Segments,
    validation: Callable[[torch.Tensor], float],
    radius: float,
    seed: int,
) -> Descent:
    """One stretch: a new matrix, then ``STRETCH`` preconditioned steps.

    Args:
        validation: RMS error on data that choose the parameters.
        radius: of the circle outside of which poles are penalised.
        seed: of the batches, together with the number of the stretch.
    """
    generator = torch.Generator().manual_seed((seed * SEED_STRIDE + state.stretch) % 2**32)
    per_segment = segments.targets.numel() / segments.count
    count = math.ceil(MATRIX_ROWS * shape.n_parameters / per_segment)
    matrix = _matrix(shape, state.theta, segments.chosen(_draw(segments, count, generator)))
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
    counted = float(batch.weights.square().mean())  # as much as its weight's square, each
    row = (done.stretch, math.sqrt(cost / counted), error)
    done = replace(done, theta=theta, momentum=momentum, history=(*state.history, row))
    if error < state.best_error:
        return replace(done, best=theta, best_error=error)
    return done


def _draw(segments: Segments, count: int, generator: torch.Generator) -> torch.Tensor:
    """Numbers of random segments, none twice."""
    order = torch.randperm(segments.count, generator=generator)[:count]
    return order.to(segments.features.device)


def _matrix(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Mean of J'J per residual, shape (P, P)."""
    return normal_equations(shape, theta, segments).matrix / segments.targets.numel()


def _factor(matrix: torch.Tensor) -> torch.Tensor | None:
    """Cholesky factor of a damped matrix; None where it is not finite."""
    diagonal = matrix.diagonal()
    damping = DAMPING * (diagonal + FLOOR * diagonal.mean())
    factor, failure = torch.linalg.cholesky_ex(matrix + torch.diag(damping))
    return None if int(failure) != 0 else factor


def _gradient(
    shape: CellShape, theta: torch.Tensor, segments: Segments, radius: float
) -> tuple[float, torch.Tensor]:
    """Mean square of the residuals with the penalty, and half its gradient, by reverse mode."""
    variable = theta.clone().requires_grad_()
    outputs, _ = simulate(shape, variable, segments.features)
    residuals = outputs[segments.burn_in :] - segments.targets
    cost = (segments.weights[:, None] * residuals).square().mean()
    if not math.isfinite(cost.detach()):
        return math.nan, torch.zeros_like(theta)
    cost = cost + (pole_radii(shape, variable) - radius).clamp_min(0).square().sum()
    (gradient,) = torch.autograd.grad(cost, variable)
    return float(cost.detach()), 0.5 * gradient
