"""The cell equation: the same of numpy arrays and torch tensors, and that of the plain loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.network.state_space.cell import GATED, Cell
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs, turned
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.plain import five_point_slope
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.plain_cell import PlainCell
from tests.strategies import state_space_shapes

SAME = 1e-12
"""Roundings of float64 in sums of some ten terms of order 1."""
SLOPE = 1e-7
"""Of a derivative of order one by five points, in float64."""


def network_of(shape: Shape) -> StateSpace:
    network = random_surrogate(shape).network
    assert isinstance(network, StateSpace)
    return network


def in_double(cell: Cell) -> Cell:
    return replace(cell, **{n: part.astype(np.float64) for n, part in cell.arrays().items()})


def as_tensors(cell: Cell) -> Cell:
    return replace(cell, **{n: torch.from_numpy(part) for n, part in cell.arrays().items()})


@given(state_space_shapes(), st.integers(1, 8))
def test_run_is_the_plain_loop_with_either_namespace(shape: Shape, samples: int) -> None:
    network, rng = network_of(shape), np.random.default_rng(shape.seed)
    features = rng.normal(size=(samples, 2, network.features.n_signals))
    cell, rest = in_double(network.cell), np.zeros((2, len(network.cell.a)))
    inputs = ByRole.of(network.roles, features)
    states = Equations(cell, inputs, network.turned, np).run(rest)
    values = outputs(cell, states, inputs)
    for sequence in range(2):
        expected, expected_states = PlainCell.of(network).run(features[:, sequence])
        assert states[:, sequence] == pytest.approx(expected_states, rel=SAME, abs=SAME)
        assert values[:, sequence] == pytest.approx(expected, rel=SAME, abs=SAME)
    of_tensors = ByRole.of(network.roles, torch.from_numpy(features))
    tensors = as_tensors(cell)
    found = Equations(tensors, of_tensors, network.turned, torch).run(torch.from_numpy(rest))
    assert found.numpy() == pytest.approx(states, rel=SAME, abs=SAME)
    assert outputs(tensors, found, of_tensors).numpy() == pytest.approx(values, rel=SAME, abs=SAME)


@pytest.mark.parametrize(
    ("kind", "pairs"), [("tanh", 0), ("mixed", 0), ("cubic", 0), (GATED, 0), (GATED, 1)]
)
def test_cell_without_hidden_units_is_run_without_their_activation(
    kind: str, pairs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Most of the time of linear fits went into activations of no units, sample by sample."""
    cell = CellShape(units=0, activation=kind, turned=pairs, substeps=2)
    features = 2 if pairs == 0 else 3
    shape = Shape(n_inputs=features, features="director" if pairs else "differences", cell=cell)
    network, rng = network_of(shape), np.random.default_rng(1)
    seen = rng.normal(size=(6, 2, network.features.n_signals))
    inputs, rest = ByRole.of(network.roles, seen), rng.normal(size=(2, len(network.cell.a)))
    equations = Equations(in_double(network.cell), inputs, network.turned, np)
    state, expected = rest, list[np.ndarray]()
    for k in (k for k in range(6) for _ in range(2)):
        state = equations.after(k, state, equations.hidden_units(k, state))
        expected.append(state)
    monkeypatch.setattr(Equations, "hidden_units", None)
    np.testing.assert_array_equal(equations.path(rest), expected)


@given(state_space_shapes())
def test_slopes_of_units_are_their_derivatives(shape: Shape) -> None:
    """Of plain units by their arguments; of gated ones by the gates' arguments and the states."""
    network, rng = network_of(shape), np.random.default_rng(shape.seed)
    features = rng.normal(size=(1, 1, network.features.n_signals))
    inputs, cell = ByRole.of(network.roles, features), in_double(network.cell)
    state = rng.normal(size=(1, len(network.cell.a)))
    equations = Equations(cell, inputs, network.turned, np)
    units = equations.hidden_units_with_slopes(0, state)
    assert units.values == pytest.approx(equations.hidden_units(0, state))

    def with_more(amount: float) -> np.ndarray:
        moved = cell.w.copy()
        moved[:, -1] += amount
        equations = Equations(replace(cell, w=moved), inputs, network.turned, np)
        return np.asarray(equations.hidden_units(0, state))

    expected = five_point_slope(with_more)
    assert units.slope == pytest.approx(expected, rel=SLOPE, abs=SLOPE)
    if cell.gated:
        assert units.seen is not None
        offered = units.seen @ equations.v_x.T + inputs.gated[0] @ equations.v_g.T
        assert units.gates * offered == pytest.approx(units.values, rel=SAME, abs=SAME)


@pytest.mark.parametrize("kind", ["numpy", "torch"])
def test_turns_act_on_the_first_pairs(kind: str) -> None:
    rows = np.random.default_rng(0).normal(size=(3, 7))
    angles = np.array([0.0, 0.5 * np.pi, 2.0])
    cosines = np.stack([np.cos(angles), np.sin(angles)], 1)
    xp = {"numpy": np, "torch": torch}[kind]
    vectors, turn = xp.asarray(rows), xp.asarray(cosines)
    found = turned(vectors, turn, 2, xp)
    moved = np.asarray(found)
    assert np.array_equal(moved[:, 4:], rows[:, 4:])
    assert moved[0] == pytest.approx(rows[0], abs=SAME)
    quarter = [-rows[1, 1], rows[1, 0], -rows[1, 3], rows[1, 2]]
    assert moved[1, :4] == pytest.approx(quarter, abs=SAME)
    again = turned(found, turn, 2, xp, back=True)
    assert np.asarray(again) == pytest.approx(rows, abs=SAME)
    assert turned(vectors, turn[:, :0], 0, xp) is vectors
