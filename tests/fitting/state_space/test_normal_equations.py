"""The normal equations against the Jacobian of the residuals by automatic differentiation."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slide_fmu.fitting.state_space import normal_equations as module
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.normal_equations import (
    BLOCK,
    ROWS_PER_PARAMETER,
    THINNEST,
    normal_equations,
    sum_of_squares,
    thinning,
)
from slide_fmu.fitting.state_space.segments import Segments
from tests.fitting.state_space.cells import (
    FACTORS,
    GATED_SHAPES,
    READ,
    SUBSTEPS,
    TURNED,
    plain,
    random,
    random_segments,
    random_theta,
    random_weights,
)
from tests.strategies import learnt_cell_shapes

EXACT = 1e-10
"""Roundings of float64 in sums of some thousand products of order 1, relative to the largest."""
FORWARD = 1e-12
"""Those of a few hundred products."""
NEIGHBOURS = 0.15
"""Deviation of a thinned matrix from the full one, relative to its norm: an eighth of some
thousand rows that the fit does not depend on in detail."""


def jacobian(
    shape: CellShape, theta: torch.Tensor, segments: Segments
) -> tuple[torch.Tensor, torch.Tensor]:
    """J (scored, B, p, P) and residuals (scored, B, p), with the segments' weights."""

    def residuals(parameters: torch.Tensor) -> torch.Tensor:
        outputs, _ = simulate(shape, parameters, segments.features, None, segments.initial)
        return segments.weights[:, None] * (outputs[segments.burn_in :] - segments.targets)

    theta = theta.clone().requires_grad_()
    values = residuals(theta)
    # columns of J as derivatives of J'w by w: there are fewer of them than rows
    w = torch.zeros_like(values, requires_grad=True)
    (product,) = torch.autograd.grad(values, theta, w, create_graph=True)
    unit = torch.eye(len(theta), dtype=theta.dtype)
    (columns,) = torch.autograd.grad(product, w, unit, is_grads_batched=True)
    return columns.movedim(0, -1), values.detach()


def deviation(found: torch.Tensor, expected: torch.Tensor) -> float:
    return float((found - expected).abs().max() / expected.abs().max().clamp_min(1e-300))


def thinned_weights(scored: int, thin: int) -> torch.Tensor:
    """How often each sample counts in J'J, shape (scored,): those of a block share its length."""
    weights = torch.zeros(scored, dtype=torch.float64)
    for first in range(0, scored, BLOCK):
        block = range(first, min(first + BLOCK, scored))
        weights[block[::thin]] = len(block) / len(block[::thin])
    return weights


SHAPES = [
    *GATED_SHAPES,
    FACTORS,
    replace(FACTORS, units="tanh", bias=False),
    replace(FACTORS, n_units=0),
    plain(4, 2, 5, 2),
    plain(4, 2, 5, 2, "cubic", False),
]


@example(READ, 3, BLOCK + 1, 9, 0)
@example(TURNED, 3, BLOCK + 1, 9, 0)
@example(SUBSTEPS, 3, BLOCK + 1, 9, 0)
@settings(max_examples=25)
@given(
    learnt_cell_shapes(),
    st.integers(0, 6),
    st.integers(1, BLOCK + 5),
    st.integers(1, 12),
    st.integers(0, 100),
)
def test_all_rows_give_the_exact_normal_equations(
    shape: CellShape, burn_in: int, scored: int, batch: int, seed: int
) -> None:
    theta = random_theta(shape, seed)
    segments = random_weights(random_segments(shape, burn_in, scored, batch, seed), seed)
    rows, residuals = jacobian(shape, theta, segments)
    j, r = rows.reshape(-1, shape.n_parameters), residuals.reshape(-1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(module.SENSITIVITIES, "cpu", 1)  # chunks of eight segments
        patch.setattr(module, "ROWS_PER_PARAMETER", 10**9)  # nothing is left out
        found = normal_equations(shape, theta, segments)
    assert deviation(found.matrix, j.T @ j) < EXACT
    assert deviation(found.gradient, j.T @ r) < EXACT
    assert found.cost == pytest.approx(float(r @ r), rel=EXACT)
    assert sum_of_squares(shape, theta, segments) == pytest.approx(found.cost, rel=EXACT)


@pytest.mark.parametrize("units", ["tanh", "cubic", "mixed"])
@pytest.mark.parametrize("bias", [True, False])
def test_thinned_matrix_is_that_of_some_samples(units: str, bias: bool) -> None:
    """Every eighth sample of each block counts for all; gradient and cost have all samples."""
    shape = plain(2, 1, 2, 2, units, bias)
    theta, scored = random_theta(shape, 5), 5 * BLOCK + 3
    segments = random_weights(random_segments(shape, 6, scored, 80))
    thin = thinning(shape, segments)
    assert thin == THINNEST
    rows, residuals = jacobian(shape, theta, segments)
    j, r = rows.reshape(-1, shape.n_parameters), residuals.reshape(-1)
    weights = thinned_weights(scored, thin)
    some = (weights.sqrt()[:, None, None, None] * rows).reshape(-1, shape.n_parameters)
    found = normal_equations(shape, theta, segments)
    assert deviation(found.matrix, some.T @ some) < EXACT
    assert deviation(found.gradient, j.T @ r) < EXACT
    assert found.cost == pytest.approx(float(r @ r), rel=EXACT)
    full = j.T @ j
    assert 0 < float((found.matrix - full).norm() / full.norm()) < NEIGHBOURS


@pytest.mark.parametrize(
    ("residuals", "thin"), [(1.0, 1), (1.99, 1), (2.0, 2), (4.0, 4), (7.99, 4), (8.0, 8), (99, 8)]
)
def test_thinning_leaves_enough_rows(residuals: float, thin: int) -> None:
    """Number of residuals relative to ROWS_PER_PARAMETER times the parameters."""
    shape = plain(2, 1, 3, 1)
    least = ROWS_PER_PARAMETER * shape.n_parameters
    count = math.ceil(residuals * least)
    samples = torch.zeros(count, 1, 1)
    found = thinning(shape, Segments(samples, samples, torch.ones(1)))
    assert found == thin
    assert thin == 1 or count // thin >= least


def test_blocks_hold_whole_strides() -> None:
    assert BLOCK % THINNEST == 0


def test_diverging_cell_has_no_finite_sum() -> None:
    shape = plain(1, 1, 0, 1)
    theta = torch.tensor([30.0, 1.0, 1.0, 0.0, 0.0], dtype=torch.float64)  # x -> 30 x + u
    segments = random_segments(shape, 0, 300, 2)
    assert not math.isfinite(sum_of_squares(shape, theta, segments))
    assert not math.isfinite(normal_equations(shape, theta, segments).cost)


@pytest.mark.parametrize("shape", [plain(3, 2, 4, 2), SUBSTEPS])
def test_segments_may_begin_at_states(shape: CellShape) -> None:
    """Chunks of them have their own; the states do not depend on the parameters."""
    theta, segments = random_theta(shape), random_segments(shape, 0, 20, 40)
    segments = replace(segments, initial=0.5 * random(40, shape.n_states, seed=5))
    rows, residuals = jacobian(shape, theta, segments)
    found = normal_equations(shape, theta, segments)
    flat = rows.reshape(-1, shape.n_parameters)
    assert deviation(found.matrix, flat.T @ flat) < EXACT
    assert deviation(found.gradient, flat.T @ residuals.reshape(-1)) < EXACT
    assert found.cost == pytest.approx(float(residuals.square().sum()), rel=EXACT)
    assert sum_of_squares(shape, theta, segments) == pytest.approx(found.cost, rel=EXACT)
    from_zero = sum_of_squares(shape, theta, replace(segments, initial=None))
    assert abs(from_zero - found.cost) > 1e-6 * found.cost
