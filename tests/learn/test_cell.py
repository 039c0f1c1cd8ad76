"""The cell as a function of one parameter vector is the cell of the frozen network."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from cells import cell_shapes, numpy_network, random, random_features, random_theta
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.learn.cell import UNITS, CellShape, simulate
from slide_fmu.state_space import CELL_ACTIVATIONS

ROUNDING = 1e-5
"""Float32 sums of some ten terms of order 1, in a cell that contracts."""


def test_every_activation_of_the_network_can_be_learnt() -> None:
    assert set(UNITS) == set(CELL_ACTIVATIONS)


@pytest.mark.parametrize("units", UNITS)
def test_units_know_their_derivative(units: str) -> None:
    values = random(50).requires_grad_()
    result, slope = UNITS[units](values)
    (expected,) = torch.autograd.grad(result.sum(), values)
    torch.testing.assert_close(slope, expected, rtol=1e-12, atol=1e-12)


@given(cell_shapes(), st.integers(1, 30), st.integers(1, 4), st.integers(0, 100))
def test_simulation_is_that_of_the_numpy_network(
    shape: CellShape, samples: int, batch: int, seed: int
) -> None:
    theta, features = random_theta(shape, seed), random_features(samples, batch, shape, seed + 1)
    outputs, states = simulate(shape, theta, features)
    rows = features.numpy().astype(np.float32).swapaxes(0, 1)
    expected, last = numpy_network(shape, theta).run(rows)
    assert np.max(np.abs(outputs.numpy().swapaxes(0, 1) - expected)) < ROUNDING
    assert np.max(np.abs(states[-1].numpy() - last)) < ROUNDING


@given(cell_shapes())
def test_split_and_join_are_inverses(shape: CellShape) -> None:
    theta = random(shape.n_parameters)
    m = shape.split(theta)
    assert torch.equal(shape.join(m), theta)
    again = shape.split(shape.join(m))
    assert all(torch.equal(getattr(again, part), getattr(m, part)) for part in vars(m))
    assert m.f.shape == (shape.n_states, shape.n_states + shape.n_features + shape.n_units)
    assert m.w.shape == (shape.n_units, shape.n_states + shape.n_features + shape.bias)
    if not shape.bias:
        assert not m.d0.any()


@given(cell_shapes(), st.integers(0, 100))
def test_states_depend_on_the_first_parameters_alone(shape: CellShape, seed: int) -> None:
    theta, features = random_theta(shape, seed), random_features(5, 2, shape, seed)
    other = theta.clone()
    other[shape.n_dynamic :] += 1.0
    outputs, states = simulate(shape, theta, features)
    changed, same = simulate(shape, other, features)
    assert torch.equal(states, same)
    assert not torch.allclose(outputs, changed)


@pytest.mark.parametrize("units", UNITS)
def test_without_constant_terms_the_cell_is_odd(units: str) -> None:
    shape = CellShape(3, 2, 4, 2, units, bias=False)
    theta, features = random_theta(shape), random_features(20, 3, shape)
    assert torch.equal(simulate(shape, theta, -features)[0], -simulate(shape, theta, features)[0])
