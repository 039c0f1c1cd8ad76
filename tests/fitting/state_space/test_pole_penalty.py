"""The penalty on poles against automatic differentiation, and where it is zero."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from slide_fmu.core.window import Window
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.normal_equations import NormalEquations
from slide_fmu.fitting.state_space.penalties import (
    LARGEST_RADIUS,
    REMAINING,
    ROOM,
    PolePenalty,
    pole_radii,
)
from tests.fitting.state_space.cells import TURNED, plain, random_theta

SHAPE = plain(4, 2, 3, 1)
EXACT = 1e-10
"""Roundings of float64 in sums of a few products of order 1."""


def nothing(shape: CellShape = SHAPE) -> NormalEquations:
    zero = torch.zeros(shape.n_parameters, dtype=torch.float64)
    return NormalEquations(0.0, torch.diag(zero), zero)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("radius", [0.1, 0.2])
@pytest.mark.parametrize("shape", [SHAPE, TURNED])
def test_normal_equations_are_those_of_its_residuals(
    seed: int, radius: float, shape: CellShape
) -> None:
    theta, penalty = random_theta(shape, seed), PolePenalty(radius, 7.0)

    def residuals(parameters: torch.Tensor) -> torch.Tensor:
        return math.sqrt(7.0) * (pole_radii(shape, parameters) - radius).clamp_min(0)

    r = residuals(theta)
    assert r.any()
    j = torch.autograd.functional.jacobian(residuals, theta)
    found = penalty.join(nothing(shape), shape, theta)
    torch.testing.assert_close(found.matrix, j.T @ j, rtol=EXACT, atol=EXACT)
    torch.testing.assert_close(found.gradient, j.T @ r, rtol=EXACT, atol=EXACT)
    assert found.cost == pytest.approx(float(r @ r), rel=EXACT)
    assert penalty.cost(shape, theta) == pytest.approx(found.cost, rel=EXACT)


def test_poles_inside_cost_nothing() -> None:
    theta = random_theta(SHAPE)
    penalty = PolePenalty(0.99, 7.0)
    assert penalty.cost(SHAPE, theta) == 0
    found = penalty.join(nothing(), SHAPE, theta)
    assert found.cost == 0
    assert not found.gradient.any()


def test_radii_are_those_of_the_state_matrix() -> None:
    theta = random_theta(SHAPE, 3)
    a = SHAPE.split(theta).a.numpy()
    expected = np.sort(np.abs(np.linalg.eigvals(a)))
    assert np.sort(pole_radii(SHAPE, theta).numpy()) == pytest.approx(expected, rel=EXACT)


def test_circle_is_what_the_truncated_samples_forget() -> None:
    penalty = PolePenalty.of(Window(0.1, 48, 8), 0.0, 100)
    assert penalty.radius**40 == pytest.approx(REMAINING)
    assert penalty.weight == 100
    assert PolePenalty.of(Window(0.1, 10**5, 1), 0.0, 1).radius == LARGEST_RADIUS


SHORT = Window(0.1, 12, 8)
"""Its circle has a radius of 0.42 where the system's poles are not known."""


@pytest.mark.parametrize("slowest", [0.5, 0.9, 0.99, 0.9975])
def test_circle_of_a_short_window_leaves_room_for_the_systems_own_poles(slowest: float) -> None:
    radius = PolePenalty.of(SHORT, slowest, 1).radius
    assert slowest < radius < 1
    assert 1 - radius == pytest.approx(ROOM * (1 - slowest))


@pytest.mark.parametrize("slowest", [0.0, 0.2, 0.4])
def test_systems_that_a_window_holds_do_not_change_its_circle(slowest: float) -> None:
    assert PolePenalty.of(SHORT, slowest, 1) == PolePenalty.of(SHORT, 0.0, 1)


@pytest.mark.parametrize("slowest", [1.0, 1.01])
def test_circle_of_a_system_that_never_forgets_is_the_largest(slowest: float) -> None:
    assert PolePenalty.of(SHORT, slowest, 1).radius == LARGEST_RADIUS


@pytest.mark.parametrize("slowest", [0.0, 0.9, 1.0])
def test_window_that_truncates_nothing_says_nothing_about_poles(slowest: float) -> None:
    window = Window(0.1, 4, 4)
    assert window.n_truncated == 0
    assert PolePenalty.of(window, slowest, 1).radius == LARGEST_RADIUS
