"""Large cells are fitted by gradient steps, preconditioned by a Gauss-Newton matrix.

With many parameters the normal equations of every step cost too much, and are valid for small
steps only. Here the matrix comes from some of the segments, is kept for a round of steps, and
scales the gradients of large random batches: natural gradient descent (Amari, 1998) with momentum.
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
"""Approximate number of residuals for each parameter in the segments that form the matrix."""
KEPT = 0.5
"""Share of the previous round's matrix in a new one."""
BATCH = 512
"""Number of segments in one gradient."""
STEPS = 80
"""Number of steps with the same matrix, one round; the validation after it decides how to go
on."""
RATE, MOMENTUM = 0.08, 0.8
"""Factor on a step, and factor on the running sum of the steps."""
RECOVERY = 1.2
"""Growth of a halved rate in every round without failure."""
DAMPING = 0.005
"""Fraction of the diagonal that is added to it, so that the matrix can be factorized."""
FLOOR = 0.1
"""The same fraction of this share of the diagonal's mean is added: hidden units without effect
have no curvature."""
FAILED = 1.5
"""A validation error of this multiple of the best one returns the fit to the best weights."""


@dataclass(frozen=True, eq=False)
class Descent:
    """A Descent is the state of a fit between two rounds.

    Attributes:
        theta: parameters, shape (P,).
        momentum: running sum of the steps, shape (P,).
        best: parameters of the best validation so far, shape (P,).
        best_error: their validation error.
        matrix: Gauss-Newton matrix per residual, shape (P, P); None before the first round.
        rate: factor on the steps, halved after a failure.
        round: number of rounds done.
        history: (round, training error, validation error) after every round.
    """

    theta: torch.Tensor
    momentum: torch.Tensor
    best: torch.Tensor
    best_error: float
    matrix: torch.Tensor | None = None
    rate: float = RATE
    round: int = 0
    history: tuple[tuple[int, float, float], ...] = ()

    @property
    def finished(self) -> bool:
        """False: a descent always does all its rounds."""
        return False

    @staticmethod
    def begin(theta: torch.Tensor, error: float) -> Descent:
        """Return the state before the first round, with the validation error there."""
        return Descent(theta, torch.zeros_like(theta), theta, error)


def advance_round(
    state: Descent,
    shape: CellShape,
    segments: Segments,
    validation: Callable[[torch.Tensor], float],
    radius: float,
    seed: int,
) -> Descent:
    """Do one round: a new matrix, then ``STEPS`` preconditioned steps.

    A round that diverges, or ends far above the best validation error, is undone: the fit
    continues from the best weights at half the rate. Poles outside the circle of ``radius``
    are penalised; the seed and the number of the round determine the batches.
    """
    generator = torch.Generator().manual_seed((seed * SEED_STRIDE + state.round) % 2**32)
    per_segment = segments.targets.numel() / segments.count
    count = math.ceil(MATRIX_ROWS * shape.n_parameters / per_segment)
    some = segments.chosen(_draw(segments, count, generator))
    matrix = normal_equations(shape, state.theta, some).matrix / some.targets.numel()
    if state.matrix is not None:
        matrix = KEPT * state.matrix + (1 - KEPT) * matrix
    factor = _factor(matrix)
    theta, momentum, cost, batch = state.theta, state.momentum, math.nan, segments
    for _ in range(STEPS):
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
    done = replace(state, round=state.round + 1)
    if factor is not None:
        done = replace(done, matrix=matrix, rate=min(RATE, RECOVERY * state.rate))
    if diverged or not error <= FAILED * state.best_error:  # true for NaN too
        return replace(
            done, theta=state.best, momentum=torch.zeros_like(theta), rate=0.5 * state.rate
        )
    counted = float(batch.weights.square().mean())  # each residual counts as its weight squared
    row = (done.round, math.sqrt(cost / counted), error)
    done = replace(done, theta=theta, momentum=momentum, history=(*state.history, row))
    if error < state.best_error:
        return replace(done, best=theta, best_error=error)
    return done


def _draw(segments: Segments, count: int, generator: torch.Generator) -> torch.Tensor:
    """Draw the numbers of at most ``count`` segments, without repetition."""
    order = torch.randperm(segments.count, generator=generator)[:count]
    return order.to(segments.features.device)


def _factor(matrix: torch.Tensor) -> torch.Tensor | None:
    """Return the Cholesky factor of the damped matrix; None if it does not exist."""
    diagonal = matrix.diagonal()
    damping = DAMPING * (diagonal + FLOOR * diagonal.mean())
    factor, failure = torch.linalg.cholesky_ex(matrix + torch.diag(damping))
    return None if int(failure) != 0 else factor


def _gradient(
    shape: CellShape, theta: torch.Tensor, segments: Segments, radius: float
) -> tuple[float, torch.Tensor]:
    """Return the mean square of the residuals with the penalty, and half its gradient.

    Half the gradient is J'r per residual, which matches the matrix J'J. It is computed in reverse
    mode: the cost does not grow with the number of parameters.
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
