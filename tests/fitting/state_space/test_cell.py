"""The cell as a function of one parameter vector is the cell of the frozen network."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import assume, example, given
from hypothesis import strategies as st

from slide_fmu.fitting.state_space.cell import CellShape, simulate
from tests.fitting.state_space.cells import (
    FACTORS,
    GATED_SHAPES,
    READ,
    SUBSTEPS,
    TURNED,
    numpy_network,
    plain,
    plain_cell,
    random,
    random_features,
    random_theta,
)
from tests.strategies import learnt_cell_shapes

ROUNDING = 1e-5
"""Float32 sums of some ten terms of order 1, in a cell that contracts."""
SAME = 1e-12
"""Roundings of float64 in sums of some ten terms of order 1."""


@example(FACTORS, 30, 4, 0)
@example(SUBSTEPS, 30, 4, 0)
@example(READ, 30, 4, 0)
@example(TURNED, 30, 4, 0)
@given(learnt_cell_shapes(), st.integers(1, 30), st.integers(1, 4), st.integers(0, 100))
def test_simulation_is_that_of_the_numpy_network(
    shape: CellShape, samples: int, batch: int, seed: int
) -> None:
    theta, features = random_theta(shape, seed), random_features(samples, batch, shape, seed + 1)
    outputs, states = simulate(shape, theta, features)
    assume(float(states.abs().max()) < 10)  # cubes may grow without bound
    rows = features.numpy().astype(np.float32).swapaxes(0, 1)
    expected, last = numpy_network(shape, theta).run(rows)
    assert np.max(np.abs(outputs.numpy().swapaxes(0, 1) - expected)) < ROUNDING
    assert np.max(np.abs(states[-1].numpy() - last)) < ROUNDING


@example(FACTORS, 0)
@example(READ, 0)
@example(TURNED, 0)
@given(learnt_cell_shapes(), st.integers(0, 100))
def test_simulation_is_what_the_equations_say(shape: CellShape, seed: int) -> None:
    theta, features = random_theta(shape, seed), random_features(8, 2, shape, seed + 1)
    outputs, states = simulate(shape, theta, features)
    assume(float(states.abs().max()) < 10)
    for sequence in range(2):
        expected, state = plain_cell(shape, theta).run(features[:, sequence].numpy())
        assert outputs[:, sequence].numpy() == pytest.approx(expected, rel=0, abs=SAME)
        assert states[:, sequence].numpy() == pytest.approx(state, rel=0, abs=SAME)


@given(learnt_cell_shapes())
def test_split_and_join_are_inverses(shape: CellShape) -> None:
    theta = random(shape.n_parameters)
    m, roles = shape.split(theta), shape.roles
    assert torch.equal(shape.join(m), theta)
    again = shape.split(shape.join(m))
    assert all(torch.equal(part, m.arrays()[name]) for name, part in again.arrays().items())
    n, p, units = shape.n_states, shape.n_outputs, shape.n_units
    gated, factors = shape.units == "gated", 1 + len(roles.readout)
    assert (m.a.shape, m.b.shape, m.e.shape) == ((n, n), (n, len(roles.drive)), (n, units))
    seen = len(roles.schedule) if gated else n + len(roles.drive)
    assert m.w.shape == (units, seen + shape.bias)
    assert (m.v.shape == (units, n + len(roles.gated))) if gated else m.v is None
    assert m.c.shape == (p * factors, n)
    assert m.d.shape == (p * factors, len(roles.static))
    assert m.d0.shape == (p * factors,)
    if not shape.bias:
        assert not m.d0.any()


@given(learnt_cell_shapes(), st.integers(0, 100))
def test_states_depend_on_the_first_parameters_alone(shape: CellShape, seed: int) -> None:
    theta, features = random_theta(shape, seed), random_features(5, 2, shape, seed)
    other = theta.clone()
    other[shape.n_dynamic :] += 1.0
    outputs, states = simulate(shape, theta, features)
    changed, same = simulate(shape, other, features)
    assert torch.equal(states, same)
    assert not torch.allclose(outputs, changed)


@pytest.mark.parametrize("units", ["tanh", "cubic", "mixed"])
def test_without_constant_terms_the_cell_is_odd(units: str) -> None:
    shape = plain(3, 2, 4, 2, units, bias=False)
    theta, features = random_theta(shape), random_features(20, 3, shape)
    assert torch.equal(simulate(shape, theta, -features)[0], -simulate(shape, theta, features)[0])


@pytest.mark.parametrize("shape", GATED_SHAPES)
def test_gated_units_are_linear_in_drive_and_gated_features(shape: CellShape) -> None:
    """Schedule, factors and turn held: states add up when f and g do."""
    one, other = (random_features(20, 3, shape, seed) for seed in (1, 2))
    roles = shape.roles
    separate = replace(roles, drive=(0, 1), static=(0, 1), gated=(1,), readout=())
    shape = replace(shape, roles=separate)
    theta, held = random_theta(shape), [*roles.schedule, *roles.turn]
    both = one + other
    for features in (both, other):
        features[:, :, held] = one[:, :, held]
    states = [simulate(shape, theta, features)[1] for features in (one, other, both)]
    torch.testing.assert_close(states[0] + states[1], states[2], rtol=0, atol=SAME)


def test_linear_model_has_no_statics_and_no_factors() -> None:
    shape = replace(READ, n_units=0)
    a, b, c = 0.2 * random(5, 5), random(5, 2), random(2, 5)
    features = random_features(12, 3, shape)
    outputs, states = simulate(shape, shape.linear(a, b, c), features)
    torch.testing.assert_close(outputs, states @ c.T)
    before = torch.cat([torch.zeros_like(states[:1]), states[:-1]])
    torch.testing.assert_close(states, before @ a.T + features[:, :, :2] @ b.T)
