"""Fits whose weights follow a physical parameter: normal equations, poles, and a whole fit."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.parameters import Parameter
from slide_fmu.fitting.problem import Physical, Problem
from slide_fmu.fitting.state_space import normal_equations as module
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.coordinates import rescale, widen_all
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.fitting.state_space.normal_equations import (
    BLOCK,
    NormalEquations,
    normal_equations,
    sum_of_squares,
)
from slide_fmu.fitting.state_space.penalties import (
    BEYOND,
    PolePenalty,
    pole_grid,
    pole_radii,
)
from slide_fmu.fitting.state_space.segments import Segments, cut_segments
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.cells import (
    plain,
    random,
    random_segments,
    random_theta,
    random_weights,
)
from tests.fitting.state_space.springs import NONLINEAR, Pair, fit, problem_of, quick
from tests.progress import silent
from tests.refusals import refused
from tests.strategies import learnt_cell_shapes

EXACT = 1e-10
"""Roundings of float64 in sums of some thousand products of order 1, relative to the largest."""
STIFFNESS = Parameter("stiffness", "1", 0.4, 0.9)
DAMPING = Parameter("damping", "1", 0.5, 2.0, transform="log")
ONE = ParameterBasis.of_degree((STIFFNESS,), 2)
BOTH = ParameterBasis.of_degree((STIFFNESS, DAMPING), 2)


def with_terms(shape: CellShape, basis: ParameterBasis) -> CellShape:
    return replace(shape, terms=len(basis.degrees))


def random_thetas(shape: CellShape, seed: int) -> torch.Tensor:
    """Coefficients of a cell that stays small for all parameters."""
    one = replace(shape, terms=1)
    first = random_theta(one, seed)
    others = [0.1 * random_theta(one, seed + term) for term in range(1, shape.terms)]
    return torch.cat([first, *others])


def with_phi(segments: Segments, basis: ParameterBasis, seed: int) -> Segments:
    """Segments with values of their own of the parameters."""
    rng = np.random.default_rng(seed)
    low, high = ([getattr(p, end) for p in basis.parameters] for end in ("low", "high"))
    values = rng.uniform(low, high, (segments.count, len(low)))
    return replace(segments, phi=torch.from_numpy(basis.values(values)))


@settings(max_examples=10, deadline=None)
@given(
    learnt_cell_shapes(),
    st.sampled_from([ONE, BOTH]),
    st.integers(0, 6),
    st.integers(1, BLOCK + 5),
    st.integers(1, 12),
    st.integers(0, 100),
)
def test_normal_equations_are_those_of_automatic_differentiation(
    shape: CellShape, basis: ParameterBasis, burn_in: int, scored: int, batch: int, seed: int
) -> None:
    shape = with_terms(shape, basis)
    theta = random_thetas(shape, seed)
    segments = random_weights(random_segments(shape, burn_in, scored, batch, seed), seed)
    segments = with_phi(segments, basis, seed)

    def residuals(parameters: torch.Tensor) -> torch.Tensor:
        outputs, _ = simulate(shape, parameters, segments.features, segments.phi)
        scaled = segments.weights[:, None] * (outputs[burn_in:] - segments.targets)
        return scaled.reshape(-1)

    r = residuals(theta)
    j = torch.autograd.functional.jacobian(residuals, theta, vectorize=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(module.SENSITIVITIES, "cpu", 1)  # chunks of eight segments
        patch.setattr(module, "ROWS_PER_PARAMETER", 10**9)  # nothing is left out
        found = normal_equations(shape, theta, segments)
    scale = float((j.T @ j).abs().max().clamp_min(1e-300))
    assert float((found.matrix - j.T @ j).abs().max()) < EXACT * scale
    torch.testing.assert_close(found.gradient, j.T @ r, rtol=EXACT, atol=EXACT * scale)
    assert found.cost == pytest.approx(float(r @ r), rel=EXACT)
    assert sum_of_squares(shape, theta, segments) == pytest.approx(found.cost, rel=EXACT)


def test_segments_keep_the_terms_of_their_trajectories() -> None:
    features, targets = random(3, 20, 2), random(3, 21, 1)
    phi = torch.arange(6, dtype=torch.float64).view(3, 2)
    segments = cut_segments(features, targets, 4, 8, phi)
    assert segments.phi is not None
    assert segments.phi.tolist() == [[0, 1], [0, 1], [2, 3], [2, 3], [4, 5], [4, 5]]
    for chosen, numbers in ((segments.every(2), [0, 2, 4]), (segments.chunks(4)[1], [4, 5])):
        assert chosen.phi is not None
        assert torch.equal(chosen.phi, segments.phi[numbers])
    both = segments.evened_out().and_others(segments, 1.0)
    assert both.phi is not None
    assert torch.equal(both.phi, torch.cat([segments.phi, segments.phi]))


@pytest.mark.parametrize("radius", [0.1, 0.2])
@pytest.mark.parametrize("basis", [ONE, BOTH])
def test_poles_are_penalised_on_a_grid(radius: float, basis: ParameterBasis) -> None:
    shape = with_terms(plain(4, 2, 3, 1), basis)
    theta, grid = random_thetas(shape, 1), pole_grid(basis)
    penalty = PolePenalty(radius, 7.0, grid)

    def residuals(parameters: torch.Tensor) -> torch.Tensor:
        radii = pole_radii(shape, parameters, grid).reshape(-1)
        return math.sqrt(7.0) * (radii - radius).clamp_min(0)

    r, j = residuals(theta), torch.autograd.functional.jacobian(residuals, theta)
    zero = torch.zeros(shape.n_parameters, dtype=torch.float64)
    found = penalty.join(NormalEquations(0.0, torch.diag(zero), zero), shape, theta)
    torch.testing.assert_close(found.matrix, j.T @ j, rtol=EXACT, atol=EXACT)
    torch.testing.assert_close(found.gradient, j.T @ r, rtol=EXACT, atol=EXACT)
    assert penalty.cost(shape, theta) == pytest.approx(float(r @ r), rel=EXACT)


def test_grid_reaches_a_little_beyond_the_corners() -> None:
    expected = [DAMPING.beyond(BEYOND)[end] for end in (0, 1)]
    points = ParameterBasis.of_degree((DAMPING,), 1)
    first, *_, last = pole_grid(points)[:, 1].tolist()
    assert (first, last) == pytest.approx(tuple(DAMPING.scaled(np.array(expected))))
    assert first < -1 < 1 < last
    assert len(pole_grid(BOTH)) == 9


def test_wider_cells_answer_as_before_for_every_parameter() -> None:
    old = with_terms(plain(3, 2, 2, 1), BOTH)
    new = replace(old, n_states=5, n_units=6)
    theta, segments = random_thetas(old, 2), with_phi(random_segments(old, 4, 12, 5), BOTH, 3)
    expected, states = simulate(old, theta, segments.features, segments.phi)
    cells = [rescale(old, cell, states, whiten=True) for cell in old.cells(theta)]
    wide = widen_all(cells, new, torch.Generator().manual_seed(0))
    assert len(wide) == new.n_parameters
    found, _ = simulate(new, wide, segments.features, segments.phi)
    torch.testing.assert_close(found, expected, rtol=1e-9, atol=1e-9)


def springs(seed: int, stiffness: np.ndarray) -> Pair:  # type: ignore[type-arg]
    """Records of a nonlinear spring, each with a stiffness of its own."""
    rng = np.random.default_rng(seed)
    inputs = torch.from_numpy(rng.uniform(-1, 1, (len(stiffness), 160, 1))).float().double()
    outputs = inputs.new_zeros(len(stiffness), 161, 1)
    position = velocity = inputs.new_zeros(len(stiffness))
    k = torch.from_numpy(stiffness)
    for sample, force in enumerate(inputs[:, :, 0].T):
        velocity = 0.3 * velocity - k * position - 0.3 * position**3 + force
        position = position + 0.5 * velocity
        outputs[:, sample + 1, 0] = position
    return inputs, outputs


def parametric_problem(folder: Path) -> Problem:
    rng = np.random.default_rng(0)
    training, validation = rng.uniform(0.38, 0.92, 16), rng.uniform(0.4, 0.9, 6)
    physical = Physical(ONE, training[:, None], validation[:, None])
    return problem_of(
        folder,
        training=springs(1, training),
        validation=springs(2, validation),
        physical=physical,
        eigenvalues=None,
    )


@pytest.mark.extended
def test_fit_follows_a_parameter_that_it_has_not_seen(tmp_path: Path) -> None:
    """A fit that knows nothing of the parameter is many times worse."""
    problem = parametric_problem(tmp_path)
    found = fit(problem, NONLINEAR, iterations=12).network
    (tmp_path / "c.pt").unlink()
    blind = fit(replace(problem, physical=None), NONLINEAR, iterations=12).network
    assert found.parameters == (STIFFNESS,)
    errors = []
    for value in (0.4, 0.57, 0.73, 0.9):
        inputs, outputs = (values.numpy() for values in springs(3, np.full(4, value)))
        rest = outputs[:, 1 + found.n_samples :]
        for network in (found.at(np.array([value])), blind):
            error = network.stream(inputs)[:, found.n_samples :] - rest
            errors.append(float(np.sqrt(np.mean(error**2) / np.mean(rest**2))))
    assert max(errors[::2]) < 0.02
    assert min(errors[1::2]) > 4 * max(errors[::2])


@pytest.mark.extended
def test_same_seed_gives_the_same_coefficients(tmp_path: Path) -> None:
    found = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        problem, sizes = parametric_problem(folder), {"order": 2, "hidden": 2}
        network = fit(problem, sizes, starts=1, iterations=2).network
        assert network.polynomial is not None
        cells = network.polynomial.terms
        found.append([part.tobytes() for cell in cells for part in cell.arrays().values()])
    assert found[0] == found[1]
    assert len(found[0]) == 3 * len(cells[0].arrays())


def test_network_of_too_many_coefficients_is_refused(tmp_path: Path) -> None:
    problem = parametric_problem(tmp_path)
    network = StateSpaceRecipe(order=2, hidden=8)
    training = quick(dense_limit=100)
    multi_start = MultiStart(fit_data(problem, network, training), silent)
    with refused(ValueError, "dense_limit = 100", "expected at least", "the coef"):
        multi_start.dense_units(2, 8)
