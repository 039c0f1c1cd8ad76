"""Cells whose weights are polynomials of parameters: formed, run and differentiated."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.parameters import starts_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.cell import GATED, MIXED_UNITS, Cell
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.parameter_slopes import parameter_slopes
from slide_fmu.network.state_space.polynomial import CellPolynomial
from tests.fmu.plain import five_point_slope
from tests.fmu.samples import PARAMETERS, CellShape, Shape, random_surrogate
from tests.plain_cell import PlainCell
from tests.refusals import refused

SAME = 1e-12
"""Roundings of float64 in sums of some ten terms of order 1."""
SLOPE = 1e-7
"""Of a derivative of order one by five points, in float64."""
CELLS = [
    CellShape(parameters=1),
    CellShape(parameters=2, activation="cubic", roles=True, factors=1),
    CellShape(states=4, parameters=3, activation=GATED, turned=1, factors=2),
    CellShape(units=0, parameters=1),
    CellShape(units=6, parameters=2, activation=MIXED_UNITS),
]
CENTRE, HALF = (np.array([0.5 * (p.high + sign * p.low) for p in PARAMETERS]) for sign in (1, -1))


def network_of(cell: CellShape, n_in: int = 12, seed: int = 3) -> StateSpace:
    network = random_surrogate(Shape(n_in=n_in, n_inputs=3, n_outputs=2, cell=cell, seed=seed))
    assert isinstance(network.network, StateSpace)
    return network.network


def some_values(network: StateSpace, seed: int) -> FloatArray:
    """Values within the ranges of a network's parameters."""
    count = len(network.parameters)
    share = np.random.default_rng(seed).uniform(-1, 1, count)
    return np.asarray(CENTRE[:count] + share * HALF[:count])


def weights(cell: Cell) -> FloatArray:
    return np.concatenate([part.reshape(-1) for part in cell.arrays().values()])


@pytest.mark.parametrize("shape", CELLS)
def test_formed_cell_is_the_sum_of_all_terms(shape: CellShape) -> None:
    network = network_of(shape)
    assert network.polynomial is not None
    values = some_values(network, 1)
    phi = network.polynomial.basis.values(values)
    expected = sum(
        factor * weights(term).astype(np.float64)
        for factor, term in zip(phi, network.polynomial.terms, strict=True)
    )
    found = network.at(values)
    assert weights(found.cell) == pytest.approx(expected, rel=1e-7, abs=1e-9)
    assert found.cell.a.dtype == np.float32
    assert (found.parameters, found.polynomial) == ((), None)
    assert found.at(np.zeros(0)) is found


def test_network_runs_at_the_start_values_unless_others_are_given() -> None:
    network = network_of(CellShape(parameters=2))
    batch = np.random.default_rng(0).normal(size=(2, 12, 3))
    at_start = network.at(starts_of(network.parameters))
    assert network.parameters == PARAMETERS[:2]
    assert np.array_equal(network.evaluate(batch), at_start.evaluate(batch))
    other = network.at(some_values(network, 5)).evaluate(batch)
    assert np.abs(other - network.evaluate(batch)).max() > 1e-3


def test_number_of_weights_is_that_of_all_terms() -> None:
    network = network_of(CellShape(parameters=2))
    assert network.count_parameters() == 6 * len(weights(network.cell))


@pytest.mark.parametrize("shape", CELLS)
@pytest.mark.parametrize("seed", range(3))
def test_slopes_are_those_of_five_points(shape: CellShape, seed: int) -> None:
    network = network_of(shape, seed=seed)
    polynomial = network.polynomial
    assert polynomial is not None
    values = some_values(network, seed)
    features = np.random.default_rng(seed).normal(size=(2, 12, network.features.n_signals))
    found = parameter_slopes(network, features, values, 4)
    assert found.shape == (2, 4, 2, len(network.parameters))

    def newest(moved: FloatArray) -> FloatArray:
        inputs = ByRole.of(network.roles, np.moveaxis(features, 1, 0))
        cell = dataclasses.replace(polynomial.terms[0], **polynomial.formed(moved))
        states = Equations(cell, inputs, network.turned, np).run(np.zeros((2, len(cell.a))))
        return np.asarray(np.moveaxis(outputs(cell, states, inputs)[-4:], 0, 1))

    for index, parameter in enumerate(network.parameters):
        half = 0.5 * (parameter.high - parameter.low)
        direction = half * np.eye(len(values))[index]
        expected = five_point_slope(lambda x, d=direction: newest(values + x * d))
        assert half * found[..., index] == pytest.approx(expected, rel=SLOPE, abs=SLOPE)


@given(st.sampled_from(CELLS), st.integers(0, 50))
def test_one_cell_for_each_sequence_gives_what_each_gives_alone(
    shape: CellShape, seed: int
) -> None:
    """In numpy and torch alike."""
    network = network_of(shape, seed=seed)
    polynomial, rng = network.polynomial, np.random.default_rng(seed)
    assert polynomial is not None
    features = rng.normal(size=(5, 3, network.features.n_signals))
    cells = [polynomial.formed(some_values(network, k)) for k in range(3)]
    stacked = {name: np.stack([cell[name] for cell in cells]) for name in cells[0]}
    found = []
    for xp, convert in ((np, np.asarray), (torch, torch.from_numpy)):
        arrays = {name: convert(part) for name, part in stacked.items()}
        cell = dataclasses.replace(polynomial.terms[0], **arrays)
        inputs = ByRole.of(network.roles, convert(features))
        rest = convert(np.zeros((3, len(network.cell.a))))
        states = Equations(cell, inputs, network.turned, xp).run(rest)
        found.append(np.asarray(outputs(cell, states, inputs)))
    for sequence, parts in enumerate(cells):
        one = dataclasses.replace(polynomial.terms[0], **parts)
        plain = PlainCell(**vars(one), roles=network.roles, turned=network.turned)
        expected, _ = plain.run(features[:, sequence])
        for values in found:
            assert values[:, sequence] == pytest.approx(expected, rel=SAME, abs=SAME)


def test_terms_of_different_shapes_are_refused() -> None:
    polynomial = network_of(CellShape(parameters=1)).polynomial
    other = network_of(CellShape(parameters=1, units=2)).polynomial
    assert polynomial is not None
    assert other is not None
    with refused(ValueError, "expected the same for all"):
        CellPolynomial(polynomial.basis, (*polynomial.terms[:2], other.terms[2]))
    with refused(ValueError, "expected 3", "2 terms"):
        CellPolynomial(polynomial.basis, polynomial.terms[:2])
    with refused(ValueError, "expected 2", "3 terms"):
        CellPolynomial(ParameterBasis.of_degree(PARAMETERS[:1], 1), polynomial.terms)


def test_terms_that_are_not_finite_are_refused() -> None:
    network = network_of(CellShape(parameters=1))
    assert network.polynomial is not None
    first, *others = network.polynomial.terms
    broken = dataclasses.replace(others[0], b=np.full_like(first.b, np.nan))
    with refused(ValueError, "not finite"):
        StateSpace(
            CellPolynomial(network.polynomial.basis, (first, broken, others[1])),
            network.n_samples,
            network.n_out,
            network.features,
        )
