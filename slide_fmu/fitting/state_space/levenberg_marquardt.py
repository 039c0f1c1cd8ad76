"""Levenberg-Marquardt minimises a sum of squares, in steps that can be stored and resumed.

The damping multiplies the diagonal of J'J (Marquardt, 1963) and follows Nielsen's rule (Madsen,
Nielsen, Tingleff, "Methods for non-linear least squares problems", 2004, algorithm 3.16). Cost and
gradient stand for the sum of squares r'r and for J'r, the half of its gradient.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch

from slide_fmu.fitting.state_space.normal_equations import NormalEquations

FIRST_DAMPING = 1e-2
"""A fit starts with this damping lambda, relative to the diagonal of J'J."""
LEAST_DAMPING = 1e-12
"""The damping falls no further, so that a few rejections bring it back."""
MOST_REJECTIONS = 12
"""The fit counts as finished after this many rejected steps in a row."""
SMALLEST_GAIN = 1e-4
"""A step is accepted if it reaches this part of the reduction that it predicts."""
DIAGONAL_FLOOR = 1e-9
"""Every entry of the damped diagonal is raised to this part of the largest: some parameters do
nothing yet."""
STALLED = 1e-6
"""An iteration that reduces the cost by less than this part of it counts as stalled."""
PATIENCE = 5
"""The fit counts as finished after this many stalled iterations in a row."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """A least-squares problem is a sum of squares to be minimised.

    Attributes:
        normal: gives the normal equations at parameters, shape (P,).
        cost: gives the sum of squares alone, which is cheaper.
        count: number of residuals, each counted as often as its weight squared.
        validation: gives the RMS error, in scaled units, on the data that choose the parameters.
    """

    normal: Callable[[torch.Tensor], NormalEquations]
    cost: Callable[[torch.Tensor], float]
    count: float
    validation: Callable[[torch.Tensor], float]


@dataclass(frozen=True, eq=False)
class Iterate:
    """An iterate says where a fit stands: it is all that the next iteration depends on.

    Attributes:
        theta: parameters, shape (P,).
        best: parameters of the best validation so far, shape (P,).
        best_error: their validation error.
        damping: lambda, relative to the diagonal of J'J.
        growth: factor of the next increase of the damping.
        stalled: number of iterations in a row that have stalled.
        finished: whether no further step helps.
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
        """Return the iterate before the first iteration, at the parameters theta, shape (P,)."""
        return Iterate(theta, theta, _finite_or_worst(problem.validation(theta)))


def advance(state: Iterate, problem: LeastSquares) -> Iterate:
    """Do one iteration: solve damped normal equations until a step reduces the cost.

    A fit whose cost is not finite, or whose steps are all rejected, is finished.
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
            damping *= max(1 / 3, 1 - (2 * gain - 1) ** 3)  # Nielsen: no jumps with the gain
            accepted = replace(state, damping=max(damping, LEAST_DAMPING), growth=2.0)
            return _take(accepted, step, (normal.cost, cost), problem)
        damping *= growth
        growth *= 2
    return replace(state, damping=damping, growth=growth, finished=True)


def _take(
    state: Iterate, step: torch.Tensor, costs: tuple[float, float], problem: LeastSquares
) -> Iterate:
    """Return the iterate after an accepted step, with the costs before and after it."""
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
    """Return the step of the damped normal equations and the reduction of the cost it predicts.

    The step is None where the damped matrix is not positive definite.
    """
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
