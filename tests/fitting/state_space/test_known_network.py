"""A fit that begins with a known network may open physical parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from slide_fmu.fitting.checkpoint import read_checkpoint
from slide_fmu.fitting.state_space.cell import simulate
from slide_fmu.fitting.state_space.fit import candidate_from
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.fitting.state_space.penalties import STRENGTHS, Prior
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.cells import plain, random_theta
from tests.fitting.state_space.springs import NONLINEAR, QUICK, fit
from tests.fitting.state_space.test_physical_parameters import (
    STIFFNESS,
    parametric_problem,
    springs,
)
from tests.progress import silent

MIDDLE = 0.65
"""Stiffness of the one spring that is known at first."""


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> StateSpace:
    """A network for the stiffness in the middle of the range."""
    problem = parametric_problem(tmp_path_factory.mktemp("known"))
    fixed = replace(
        problem,
        training=springs(4, np.full(16, MIDDLE)),
        validation=springs(5, np.full(6, MIDDLE)),
        physical=None,
    )
    return fit(fixed, NONLINEAR, iterations=20).network


@pytest.mark.extended
def test_start_answers_as_the_known_network_for_every_parameter(
    tmp_path: Path, known: StateSpace
) -> None:
    problem = replace(parametric_problem(tmp_path), start=known)
    network, training = StateSpaceRecipe(), QUICK
    data = fit_data(problem, network, training)
    found = candidate_from(known, MultiStart(data, silent))
    assert found.shape.terms == 3
    segments = data.whole
    outputs, _ = simulate(found.shape, found.state.best, segments.features, segments.phi)
    own, _ = simulate(
        replace(found.shape, terms=1),
        found.state.best[: found.shape.n_weights],
        segments.features,
    )
    torch.testing.assert_close(outputs, own, rtol=1e-9, atol=1e-9)
    assert float(outputs.std()) > 0.1


def test_fit_from_a_known_network_learns_the_parameter(tmp_path: Path, known: StateSpace) -> None:
    """It soon does far better than the known network, away from the stiffness of that one."""
    problem = replace(parametric_problem(tmp_path), start=known)
    found = fit(problem, {}, iterations=20).network
    assert found.parameters == (STIFFNESS,)
    assert found.cell.w.shape == known.cell.w.shape
    for value in (0.42, 0.88):
        inputs, outputs = (values.numpy() for values in springs(3, np.full(4, value)))
        rest = outputs[:, 1 + known.n_samples :]
        errors = []
        for network in (found.at(np.array([value])), known):
            error = network.stream(inputs)[:, known.n_samples :] - rest
            errors.append(float(np.sqrt(np.mean(error**2) / np.mean(rest**2))))
        assert errors[0] < 0.02
        assert errors[0] < 0.2 * errors[1]


@pytest.mark.parametrize("simulated", [True, False])
def test_only_measured_data_hold_the_known_weights(
    tmp_path: Path, known: StateSpace, simulated: bool
) -> None:
    """Weights that are held share the iterations among several strengths."""
    eigenvalues = np.array([-0.1 + 0.8j]) if simulated else None
    problem = replace(parametric_problem(tmp_path), start=known, eigenvalues=eigenvalues)
    fit(problem, {}, iterations=8)
    runs = read_checkpoint(problem.checkpoint, torch.device("cpu"))
    held = {name for name in runs if "prior" in name}
    assert (not held, len(runs)) == ((True, 1) if simulated else (False, len(STRENGTHS)))


@pytest.mark.parametrize("simulated", [True, False])
def test_simulated_data_that_differ_from_validation_are_learnt(
    tmp_path: Path, known: StateSpace, simulated: bool
) -> None:
    """The known network is the best by validation, which does not have the new stiffness."""
    new = 0.9
    problem = replace(
        parametric_problem(tmp_path),
        training=springs(6, np.full(16, new)),
        validation=springs(5, np.full(6, MIDDLE)),
        physical=None,
        start=known,
        eigenvalues=np.array([-0.1 + 0.8j]) if simulated else None,
    )
    found = fit(problem, {}, iterations=6).network
    inputs, outputs = (values.numpy() for values in springs(3, np.full(4, new)))
    own, before = (
        float(np.std((network.stream(inputs) - outputs[:, 1:])[:, known.n_samples :]))
        for network in (found, known)
    )
    assert (own < 0.2 * before) == simulated


def test_coefficients_of_terms_are_held_like_the_constant_ones() -> None:
    """They are zero at first, which must not hold them for ever."""
    one = plain(3, 2, 4, 1)
    shape = replace(one, terms=3)
    weights = random_theta(one, 0)
    theta = torch.cat([weights, weights.new_zeros(2 * one.n_weights)])
    expected = Prior.around(one, weights, 0.3).precision
    assert torch.equal(Prior.around(shape, theta, 0.3).precision, expected.repeat(3))
