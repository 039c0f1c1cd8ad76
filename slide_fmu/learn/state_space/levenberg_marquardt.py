"""Levenberg-Marquardt with Marquardt's diagonal and Nielsen's damping (Madsen, Nielsen, Tingleff,
"Methods for non-linear least squares problems", 2004), in steps that can be stored and resumed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch

from slide_fmu.learn.state_space.normal_equations import NormalEquations

FIRST_DAMPING = 1e-2
LEAST_DAMPING = 1e-12
MOST_REJECTIONS = 12
"""Rejected steps in a row after which the fit counts as finished."""
SMALLEST_GAIN = 1e-4
"""Least ratio of the reached to the predicted reduction of an accepted step."""
DIAGONAL_FLOOR = 1e-9
"""Of the damped diagonal, relative to its largest entry: parameters that do nothing yet."""
STALLED = 1e-6
"""Relative reduction of the cost per iteration, below which ...
"""
PATIENCE = 5
"""... for so many iterations in a row the fit counts as finished."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """A sum of squares to be minimised.

    Attributes:
        normal: its normal equations at parameters.
        cost: its value alone, which is cheaper.
        count: number of residuals, each as much as its weight's square.
        validation: RMS error on data that choose the parameters.
    """

    normal: Callable[[torch.Tensor], NormalEquations]
    cost: Callable[[torch.Tensor], float]
    count: float
    validation: Callable[[torch.Tensor], float]


@dataclass(frozen=True, eq=False)
class Iterate:
    """Where a fit stands; all that the next iteration depends on.

    Attributes:
        theta: parameters, shape (P,).
        best: parameters of the best validation so far.
        best_error: their validation error.
        damping: lambda, relative to the diagonal of J'J.
        growth: factor of the next increase of the damping.
        stalled: iterations in a row that reduced the cost by next to nothing.
        finished: no further step helps.
        history: (iteration, training error, validation error) after every iteration.
    """

    theta: torch.Tensor
    best: torch.Tensor
    best_error: float
    damping: float = FIRST_DAMPING
    growth: float = 2.0
    stalled: int = 0
    finished: bool = False
    history: tuple[tuple[int, float, float], ...] = ()

    @staticmethod
    def begin(theta: torch.Tensor, problem: LeastSquares) -> Iterate:
        """Before the first iteration."""
        return Iterate(theta, theta, _finite_or_worst(problem.validation(theta)))


def advance(state: Iterate, problem: LeastSquares) -> Iterate:
    """One iteration: normal equations, then damped steps until one reduces the cost.

    A start whose cost is not finite, or whose steps all fail, is finished.
    """
    normal = problem.normal(state.theta)
    if not math.isfinite(normal.cost):
        return replace(state, finished=True)
    damping, growth = state.damping, state.growth
    for _ in range(MOST_REJECTIONS):
        step, predicted = _damped_step(normal, damping)
        cost = math.nan if step is None else problem.cost(state.theta + step)
        gain = (normal.cost - cost) / predicted if predicted > 0 else -1.0
        if step is not None and gain > SMALLEST_GAIN:  # false for a cost that is not a number
            damping *= max(1 / 3, 1 - (2 * gain - 1) ** 3)
            accepted = replace(state, damping=max(damping, LEAST_DAMPING), growth=2.0)
            return _take(accepted, step, (normal.cost, cost), problem)
        damping *= growth
        growth *= 2
    return replace(state, damping=damping, growth=growth, finished=True)


def _take(
    state: Iterate, step: torch.Tensor, costs: tuple[float, float], problem: LeastSquares
) -> Iterate:
    """The state after an accepted step that changes the cost from the first to the second."""
    theta = state.theta + step
    error = _finite_or_worst(problem.validation(theta))
    iteration = state.history[-1][0] + 1 if state.history else 1
    row = (iteration, math.sqrt(costs[1] / problem.count), error)
    stalled = state.stalled + 1 if costs[0] - costs[1] < STALLED * costs[0] else 0
    better = error < state.best_error
    return replace(
        state,
        theta=theta,
        best=theta if better else state.best,
        best_error=min(error, state.best_error),
        stalled=stalled,
        finished=stalled >= PATIENCE,
        history=(*state.history, row),
    )


def _damped_step(normal: NormalEquations, damping: float) -> tuple[torch.Tensor | None, float]:
    """Step of the damped normal equations and the reduction of the cost it predicts."""
    diagonal = normal.matrix.diagonal()
    floor = DIAGONAL_FLOOR * float(diagonal.max())
    damped = normal.matrix + torch.diag(damping * diagonal.clamp_min(floor))
    factor, failure = torch.linalg.cholesky_ex(damped)
    if int(failure) != 0:
        return None, 0.0
    step = -torch.cholesky_solve(normal.gradient[:, None], factor)[:, 0]
    predicted = -float(2 * step @ normal.gradient + step @ (normal.matrix @ step))
    return step, predicted


def _finite_or_worst(error: float) -> float:
    return error if math.isfinite(error) else math.inf
