"""Levenberg-Marquardt on problems whose answers are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.fitting.state_space.levenberg_marquardt import (
    LASTING,
    PATIENCE,
    Iterate,
    LeastSquares,
    advance,
)
from slide_fmu.fitting.state_space.normal_equations import NormalEquations
from tests.fitting.state_space.cells import random

Function = Callable[[torch.Tensor], torch.Tensor]

CONVERGED = 1e-10
"""Of parameters of order 1, after steps that converge faster than linearly."""


def problem_of(
    residuals: Function, validation: Callable[[torch.Tensor], float] | None = None
) -> LeastSquares:
    """The sum of squares of a function; validated by itself if not told otherwise."""

    def normal(theta: torch.Tensor) -> NormalEquations:
        j, r = torch.autograd.functional.jacobian(residuals, theta), residuals(theta)
        return NormalEquations(float(r @ r), j.T @ j, j.T @ r)

    def cost(theta: torch.Tensor) -> float:
        return float(residuals(theta).square().sum())

    def rms(theta: torch.Tensor) -> float:
        return math.sqrt(cost(theta)) if cost(theta) >= 0 else math.nan

    return LeastSquares(normal, cost, 4, validation or rms)


def run(theta: torch.Tensor, problem: LeastSquares, iterations: int) -> Iterate:
    state = Iterate.begin(theta, problem)
    for _ in range(iterations):
        if not state.finished:
            state = advance(state, problem)
    return state


def test_linear_problem_is_solved_in_a_few_iterations() -> None:
    a, b = random(30, 5), random(30, seed=1)
    exact = torch.linalg.lstsq(a, b[:, None]).solution[:, 0]
    state = run(torch.zeros(5, dtype=torch.float64), problem_of(lambda t: a @ t - b), 7)
    assert float((state.best - exact).abs().max()) < CONVERGED
    steps, training, errors = zip(*state.history, strict=True)
    assert steps == tuple(range(1, len(steps) + 1))
    assert training[-1] == pytest.approx(float((a @ exact - b).square().sum() / 4) ** 0.5)
    assert state.best_error == min(errors)


def test_scales_of_the_parameters_make_no_difference() -> None:
    """Marquardt's diagonal: parameters in other units take the same steps."""
    a, b = random(30, 3), random(30, seed=1)
    units = torch.tensor([0.1, 1.0, 100.0], dtype=torch.float64)
    zero = torch.zeros(3, dtype=torch.float64)
    one = run(zero, problem_of(lambda t: (a @ t - b).sin()), 4)
    other = run(zero, problem_of(lambda t: (a @ (t * units) - b).sin()), 4)
    torch.testing.assert_close(other.theta * units, one.theta, rtol=1e-8, atol=1e-10)


def test_curved_valley_is_followed_to_its_end() -> None:
    def rosenbrock(t: torch.Tensor) -> torch.Tensor:
        return torch.stack([10 * (t[1] - t[0] ** 2), 1 - t[0]])

    state = run(torch.tensor([-1.2, 1.0], dtype=torch.float64), problem_of(rosenbrock), 60)
    assert float((state.best - 1).abs().max()) < CONVERGED


def test_steps_out_of_the_domain_are_shortened() -> None:
    """The undamped step from exp(5) leads to where the logarithm is not a number."""
    start = torch.tensor([math.exp(5.0)], dtype=torch.float64)
    problem = problem_of(torch.log)
    assert math.isnan(problem.cost(start - 5 * start))
    assert float(run(start, problem, 40).best) == pytest.approx(1.0, abs=CONVERGED)


@given(st.integers(0, 1000), st.integers(0, 12))
def test_best_parameters_are_those_of_the_best_validation(seed: int, iterations: int) -> None:
    """Validation by another sum of squares: the best may be anywhere on the way."""
    a, b, c = random(8, 3, seed=seed), random(8, seed=seed + 1), random(8, seed=seed + 2)
    other = problem_of(lambda t: (a @ t - b - c).sin())
    problem = problem_of(lambda t: (a @ t - b).sin(), other.validation)
    start = random(3, seed=seed + 3)
    state = run(start, problem, iterations)
    errors = [other.validation(start), *(error for _, _, error in state.history)]
    assert state.best_error == min(errors)
    assert other.validation(state.best) == state.best_error
    costs = [error for _, error, _ in state.history]
    assert costs == sorted(costs, reverse=True)


def test_what_makes_validation_worse_is_not_kept() -> None:
    start = torch.zeros(2, dtype=torch.float64)
    problem = problem_of(lambda t: t - 1, lambda t: 0.5 + float(t.norm()))
    state = run(start, problem, 5)
    assert len(state.history) > 0
    assert float((state.theta - 1).abs().max()) < 0.1
    assert torch.equal(state.best, start)
    assert state.best_error == 0.5


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_start_without_finite_cost_is_finished(value: float) -> None:
    problem = problem_of(lambda t: value * (t + 1), lambda t: value)
    state = run(torch.zeros(2, dtype=torch.float64), problem, 3)
    assert state.finished
    assert state.best_error == math.inf
    assert state.history == ()


def test_fit_at_its_minimum_is_finished() -> None:
    state = run(torch.ones(2, dtype=torch.float64), problem_of(lambda t: t - 1), 2)
    assert state.finished
    assert state.best_error == 0


def test_parameters_that_do_nothing_stay() -> None:
    start = torch.tensor([3.0, 4.0], dtype=torch.float64)
    state = run(start, problem_of(lambda t: t[:1] - 1), 8)
    assert float(state.best[0]) == pytest.approx(1.0, abs=CONVERGED)
    assert float(state.best[1]) == 4.0


def test_stalled_fit_is_finished() -> None:
    """One residual never falls, beside it the other one is next to nothing, for ever."""

    def residuals(t: torch.Tensor) -> torch.Tensor:
        return torch.cat([1e4 + 0 * t, torch.exp(-t)])

    state = run(torch.zeros(1, dtype=torch.float64), problem_of(residuals), 50)
    assert state.finished
    assert len(state.history) == PATIENCE


@pytest.mark.parametrize(("factor", "iterations"), [(1.0, LASTING), (0.9995, 40), (0.98, 40)])
def test_fit_whose_validation_falls_no_more_is_finished(factor: float, iterations: int) -> None:
    """It goes on where many small gains together are one that is noticed."""
    calls = []

    def validation(theta: torch.Tensor) -> float:
        calls.append(theta)
        return factor ** len(calls)

    curved = problem_of(lambda x: torch.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]]), validation)
    slow = LeastSquares(curved.normal, curved.cost, 4, validation)
    state = Iterate.begin(torch.tensor([-30.0, 50.0], dtype=torch.float64), slow)
    done = 0
    while not state.finished and done < 40:
        state = replace(advance(state, slow), stalled=0)
        done += 1
    assert done == iterations


def test_some_parameters_are_found_while_the_others_stay() -> None:
    """The least squares of a line through the origin, whose other coefficient is given."""
    x = torch.linspace(-1.0, 1.0, 9, dtype=torch.float64)
    problem = problem_of(lambda theta: theta[0] * x**2 + theta[1] * x - (2 * x + 0.5 * x**2))
    theta, free = torch.tensor([0.25, 0.0], dtype=torch.float64), torch.tensor([1])
    some = problem.restricted(theta, free)
    done = run(theta[free], some, 20)
    assert done.best.tolist() == pytest.approx([2.0], abs=1e-6)
    assert theta.tolist() == [0.25, 0.0]
    whole = problem.cost(torch.tensor([0.25, float(done.best[0])], dtype=torch.float64))
    assert some.cost(done.best) == pytest.approx(whole)
