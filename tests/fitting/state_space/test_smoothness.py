"""The penalty on coefficients of few specimens: what it adds, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from slide_fmu.fitting.state_space.normal_equations import NormalEquations
from slide_fmu.fitting.state_space.penalties import CHANGE, FEW, Smoothness
from tests.fitting.state_space.cells import plain


def terms_of(different: int) -> np.ndarray:
    """Two terms of many trajectories, with so many different values."""
    values = np.arange(1000) % different
    return np.stack([np.ones(1000), values], axis=1)


def test_penalty_is_for_few_different_values_alone() -> None:
    assert Smoothness.of(None, 100).weight == 0.0
    assert Smoothness.of(terms_of(2 * FEW), 100).weight == 0.0
    few = Smoothness.of(terms_of(2 * FEW - 1), 100)
    assert few.weight == pytest.approx(100 * CHANGE**2)


def test_penalty_adds_the_squares_of_all_coefficients_but_the_constant_ones() -> None:
    shape = replace(plain(2, 1, 3, 1), terms=2)
    theta = torch.linspace(-1, 1, shape.n_parameters, dtype=torch.float64)
    count = len(theta)
    assert count == 2 * shape.n_weights
    nothing = NormalEquations(
        0.0, torch.zeros(count, count, dtype=theta.dtype), torch.zeros_like(theta)
    )
    penalty = Smoothness(3.0)
    found = penalty.join(nothing, shape, theta)
    follows = theta[shape.n_weights :]
    assert found.cost == pytest.approx(3.0 * float(follows @ follows))
    assert found.cost == pytest.approx(penalty.cost(shape, theta))
    expected = torch.cat([torch.zeros(shape.n_weights), torch.full((len(follows),), 3.0)])
    assert torch.equal(found.matrix, torch.diag(expected.to(theta)))
    assert torch.equal(found.gradient, expected * theta)
    assert Smoothness(0.0).join(nothing, shape, theta) is nothing
