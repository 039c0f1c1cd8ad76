"""Levenberg-Marquardt minimises a sum of squares, in steps that can be stored and resumed.

The damping multiplies the diagonal of J'J (Marquardt, 1963) and follows Nielsen's rule (Madsen,
Nielsen, Tingleff, "Methods for non-linear least squares problems", 2004, algorithm 3.16). The cost
is the sum of squares r'r; the gradient is J'r, half of its derivative.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch

from slide_fmu.fitting.state_space.normal_equations import NormalEquations

FIRST_DAMPING = 1e-2
"""Damping lambda at the start of a fit, relative to the diagonal of J'J."""
LEAST_DAMPING = 1e-12
"""Smallest damping, so that a few rejections can raise it again."""
MOST_REJECTIONS = 12
"""Number of successively rejected steps after which the fit is finished."""
SMALLEST_GAIN = 1e-4
"""A step is accepted if it reaches this fraction of its predicted reduction."""
DIAGONAL_FLOOR = 1e-9
"""Smallest entry of the damped diagonal, relative to the largest: some parameters have no effect
yet."""
STALLED = 1e-6
"""An iteration stalls if it reduces the cost by less than this fraction."""
PATIENCE = 5
"""Number of successively stalled iterations after which the fit is finished."""


IMPROVED, LASTING = 0.99, 25
"""A fit is also finished when its best validation error has not fallen to the first number times
what it was in the second number of iterations: what it learns then does not hold elsewhere."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """LeastSquares is a sum of squares to minimise.

    Attributes:
        normal: returns the normal equations at parameters, shape (P,).
        cost: returns only the sum of squares, which is cheaper.
        count: number of residuals, each counted as its weight squared.
        validation: returns the RMS error, in scaled units, on the data that select the parameters.
    """

    normal: Callable[[torch.Tensor], NormalEquations]
    cost: Callable[[torch.Tensor], float]
    count: float
    validation: Callable[[torch.Tensor], float]

    def restricted(self, theta: torch.Tensor, free: torch.Tensor) -> LeastSquares:
        """Return the problem of the parameters with the numbers ``free``; the others stay."""

        def whole(part: torch.Tensor) -> torch.Tensor:
            return theta.index_copy(0, free, part)

        def normal(part: torch.Tensor) -> NormalEquations:
            equations = self.normal(whole(part))
            matrix = equations.matrix[free][:, free]
            return NormalEquations(equations.cost, matrix, equations.gradient[free])

        return LeastSquares(
            normal,
            lambda part: self.cost(whole(part)),
            self.count,
            lambda part: self.validation(whole(part)),
        )


@dataclass(frozen=True, eq=False)
class Iterate:
    """An Iterate is the state of a fit: the next iteration depends only on it.

    Attributes:
        theta: parameters, shape (P,).
        best: parameters of the best validation so far, shape (P,).
        best_error: their validation error.
        damping: lambda, relative to the diagonal of J'J.
        growth: factor of the next increase of the damping.
        stalled: number of successively stalled iterations.
        finished: whether no further step helps.
        improved: the best validation error when it last fell noticeably.
        unimproved: number of iterations since then.
        history: (iteration, training error, validation error) after every iteration.
    """

    theta: torch.Tensor
    best: torch.Tensor
    best_error: float
    damping: float = FIRST_DAMPING
    growth: float = 2.0
    stalled: int = 0
    finished: bool = False
    improved: float = math.inf
    unimproved: int = 0
    history: tuple[tuple[int, float, float], ...] = ()

    @staticmethod
    def begin(theta: torch.Tensor, problem: LeastSquares) -> Iterate:
        """Return the iterate before the first iteration, at the parameters theta, shape (P,)."""
        error = _finite_or_worst(problem.validation(theta))
        return Iterate(theta, theta, error, improved=error)


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
        if step is not None and gain > SMALLEST_GAIN:  # false if the cost is not a number
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
    improves = error < IMPROVED * state.improved
    unimproved = 0 if improves else state.unimproved + 1
    return replace(
        state,
        theta=theta,
        best=theta if better else state.best,
        best_error=min(error, state.best_error),
        stalled=stalled,
        finished=stalled >= PATIENCE or unimproved >= LASTING,
        improved=error if improves else state.improved,
        unimproved=unimproved,
        history=(*state.history, row),
    )


def _damped_step(normal: NormalEquations, damping: float) -> tuple[torch.Tensor | None, float]:
    """Return the step of the damped normal equations and the reduction of the cost it predicts.

    The step is None if the damped matrix is not positive definite.
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
