"""The prior around known weights against automatic differentiation, and what it holds."""

from __future__ import annotations

import pytest
import torch

from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate, LeastSquares, advance
from slide_fmu.fitting.state_space.normal_equations import NormalEquations
from slide_fmu.fitting.state_space.penalties import Prior
from tests.fitting.state_space.cells import plain, random_theta

SHAPE = plain(3, 2, 4, 1)
EXACT = 1e-10
"""Roundings of float64 in sums of a few products of order 1."""
MOVED = 0.5
"""Data that tell of the first weight alone ask for this change of it."""


def telling_one_weight(centre: torch.Tensor) -> LeastSquares:
    """One residual, of the first weight; every other weight may be anything."""

    def residual(theta: torch.Tensor) -> torch.Tensor:
        return theta[0] - centre[0] - MOVED

    def normal(theta: torch.Tensor) -> NormalEquations:
        j = torch.zeros_like(theta)
        j[0] = 1.0
        r = residual(theta)
        return NormalEquations(float(r**2), torch.outer(j, j), j * r)

    return LeastSquares(normal, lambda theta: float(residual(theta) ** 2), 1, lambda _: 1.0)


def test_normal_equations_are_those_of_one_residual_for_each_weight() -> None:
    centre, theta = random_theta(SHAPE, 0), random_theta(SHAPE, 1)
    prior = Prior.around(SHAPE, centre, 0.3)

    def residuals(parameters: torch.Tensor) -> torch.Tensor:
        of_prior = prior.precision.sqrt() * (parameters - centre)
        return torch.cat([parameters[:1] - centre[:1] - MOVED, of_prior])

    j, r = torch.autograd.functional.jacobian(residuals, theta), residuals(theta)
    joined = prior.joined(telling_one_weight(centre))
    found = joined.normal(theta)
    torch.testing.assert_close(found.matrix, j.T @ j, rtol=EXACT, atol=EXACT)
    torch.testing.assert_close(found.gradient, j.T @ r, rtol=EXACT, atol=EXACT)
    assert found.cost == pytest.approx(float(r @ r), rel=EXACT)
    assert joined.cost(theta) == pytest.approx(found.cost, rel=EXACT)


@pytest.mark.parametrize(("strength", "least", "most"), [(1e-6, 0.99, 1.0), (1e3, 0.0, 0.01)])
def test_weights_move_as_far_as_the_strength_lets_them(
    strength: float, least: float, most: float
) -> None:
    centre = random_theta(SHAPE, 0)
    problem = Prior.around(SHAPE, centre, strength).joined(telling_one_weight(centre))
    state = Iterate.begin(centre, problem)
    for _ in range(20):
        state = state if state.finished else advance(state, problem)
    moved = (state.theta - centre) / MOVED
    assert least <= float(moved[0]) <= most
    assert not moved[1:].any()


def test_weight_that_is_zero_has_the_size_of_its_matrix() -> None:
    centre = torch.ones(SHAPE.n_parameters, dtype=torch.float64)
    centre[0] = 0.0
    precision = Prior.around(SHAPE, centre, 1.0).precision
    assert precision[0] == pytest.approx(1.0, rel=0.1)
    assert precision[1] == pytest.approx(0.5, rel=0.1)
