"""State-space networks against plain loops; their three evaluations against each other."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.base import Float32Array
from slide_fmu.network.state_space.cell import Cell, Roles
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.plain import plain_features, plain_pair
from tests.fmu.samples import CellShape, Shape, random_cell, random_surrogate
from tests.refusals import refused
from tests.strategies import state_space_shapes

ROUNDING = 1e-5
"""Float32 sums of some ten terms of order 1, in a cell that contracts."""


def network_of(shape: Shape) -> StateSpace:
    network = random_surrogate(shape).network
    assert isinstance(network, StateSpace)
    return network


@given(state_space_shapes())
def test_window_is_the_plain_loop(shape: Shape) -> None:
    network = network_of(shape)
    batch = np.random.default_rng(shape.seed).normal(size=(3, shape.n_in, shape.n_inputs))
    found, blocks = network.evaluate(batch), network.block(batch, shape.n_out)
    assert found.dtype == blocks.dtype == np.float32
    assert found.shape == (3, shape.n_outputs)
    assert blocks.shape == (3, shape.n_out, shape.n_outputs)
    for row, block, sequence in zip(found, blocks, batch, strict=True):
        expected, _ = plain_pair(network, plain_features(network.features, sequence))
        assert block == pytest.approx(expected[-shape.n_out :], abs=ROUNDING)
        assert np.array_equal(row, block[-1])


def plain_ping_pong(network: StateSpace, record: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The first input is held for 2 n_samples; then the record goes on."""
    lead = 2 * network.n_samples - 1
    held = np.concatenate([np.repeat(record[:1], lead, axis=0), record])
    values, errors = plain_pair(network, plain_features(network.features, held))
    return values[lead:], errors[lead:]


@pytest.mark.extended
@given(state_space_shapes(), st.integers(1, 45))
def test_ping_pong_is_the_plain_loop(shape: Shape, count: int) -> None:
    """Hand-overs and truncation errors included."""
    network = network_of(shape)
    records = np.random.default_rng(shape.seed).normal(size=(2, count, shape.n_inputs))
    values, errors = network.ping_pong(records)
    assert values.dtype == errors.dtype == np.float32
    assert np.array_equal(network.stream(records), values)
    for record, value, error in zip(records, values, errors, strict=True):
        expected, expected_errors = plain_ping_pong(network, record)
        assert value == pytest.approx(expected, abs=ROUNDING)
        assert error == pytest.approx(expected_errors, abs=ROUNDING)


SLOW = Shape(n_in=20, n_out=5, cell=CellShape(states=4, contraction=0.8))
"""Forgets to one part in a hundred over its window, far above rounding."""


def recursive(network: StateSpace, records: FloatArray) -> Float32Array:
    """One state that is never restarted; the first input counts as held for n_samples."""
    lead = network.n_samples - 1
    padded = np.pad(records, ((0, 0), (lead, 0), (0, 0)), mode="edge")
    return network.run(network.features.along(padded))[0][:, lead:]


def test_three_evaluations_agree_within_the_truncation_error() -> None:
    network = network_of(SLOW)
    records = np.random.default_rng(1).normal(size=(1, 400, 1))
    windows = np.lib.stride_tricks.sliding_window_view(records[0], 20, axis=0)
    exact = network.evaluate(np.moveaxis(windows, -1, 1))[40:]
    (ping_pong,), (errors,) = network.ping_pong(records)
    (endless,) = recursive(network, records)
    largest = np.max(errors)
    assert 10 * ROUNDING < largest < 0.1
    for one, other in ((ping_pong[59:], exact), (endless[59:], exact), (ping_pong, endless)):
        assert np.max(np.abs(one - other)) < 2 * largest


def test_truncation_error_covers_the_whole_fade() -> None:
    """With a long fade the younger state counts long before it has forgotten."""
    network = network_of(dataclasses.replace(SLOW, n_out=16))
    records = np.random.default_rng(3).normal(size=(1, 600, 1))
    (ping_pong,), (errors,) = network.ping_pong(records)
    deviation = np.abs(ping_pong - recursive(network, records)[0])
    at_hand_over = deviation[19::20].max()
    assert deviation.max() > 5 * at_hand_over
    assert 0.7 * deviation.max() < errors.max() < 1.5 * deviation.max()


def test_no_jump_at_the_hand_over() -> None:
    """Under a held input the true value rests; a switch without fade would jump by its error."""
    cell = CellShape(states=1, units=0, contraction=0.95)
    network = network_of(dataclasses.replace(SLOW, cell=cell))
    values, errors = network.ping_pong(np.ones((1, 200, 1)))
    largest = float(np.max(errors))
    steps = np.abs(np.diff(values, axis=1))
    assert largest > 0.01
    assert np.max(steps) < 1.5 * largest / network.n_out


@given(state_space_shapes())
def test_memory_is_finite(shape: Shape) -> None:
    """Inputs before the last 2 n_in and the three of the features have no influence at all."""
    network, rng = network_of(shape), np.random.default_rng(shape.seed)
    record = rng.normal(size=(4 * shape.n_in + 8, shape.n_inputs))
    changed = record.copy()
    first = 2 * shape.n_in + 3
    changed[:first] = rng.normal(size=(first, shape.n_inputs))
    seen = first + 2 * shape.n_in + BEFORE
    one, other = (network.stream(inputs[None])[0] for inputs in (record, changed))
    assert not np.array_equal(one[:first], other[:first])
    assert np.array_equal(one[seen:], other[seen:])


def test_parameters_are_counted() -> None:
    plain = Shape(n_inputs=2, n_outputs=2, cell=CellShape(3, 5))
    assert network_of(plain).count_parameters() == 9 + 6 + 15 + 5 * 6 + 6 + 4 + 2
    network = network_of(dataclasses.replace(plain, cell=CellShape(3, 5, "gated", factors=1)))
    drive, static, gated, schedule = (
        len(getattr(network.roles, name)) for name in ("drive", "static", "gated", "schedule")
    )
    units = 5 * (schedule + 1) + 5 * (3 + gated)
    expected = 9 + 3 * drive + 15 + units + 4 * (3 + static + 1)
    assert network.count_parameters() == expected


def test_a_cell_without_units_is_affine() -> None:
    assert network_of(Shape(cell=CellShape(units=0))).is_affine
    assert network_of(Shape(differences=2, cell=CellShape(units=0, roles=True))).is_affine
    assert not network_of(Shape(cell=CellShape(units=1))).is_affine
    assert not network_of(Shape(cell=CellShape(units=0, factors=1))).is_affine
    for features in ("director", "chain"):
        shape = Shape(n_inputs=2, features=features, cell=CellShape(units=0))  # type: ignore[arg-type]
        assert not network_of(shape).is_affine


CELL = random_cell(CellShape(), 1, 1, 0)
ONE, THREE = FeatureMap(Differences(1)), FeatureMap(Differences(3))
ROLES = Roles(drive=(0,), static=(1, 2), gated=(2,), schedule=(0, 1), readout=(2,))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"activation": "relu"}, "'relu'; expected one of"),
        ({"a": np.zeros(3, np.float32)}, r"a of shape \(3,\), float32; expected \(3, 3\)"),
        ({"a": np.zeros((0, 0), np.float32)}, "0 states"),
        ({"c": np.zeros((0, 3), np.float32)}, "0 rows"),
        ({"a": np.zeros((3, 2), np.float32)}, r"a of shape \(3, 2\), float32; expected \(3, 3\)"),
        ({"w": np.zeros((5, 4), np.float32)}, r"w of shape \(5, 4\).*expected \(5, 5\)"),
        ({"d0": np.zeros(1)}, "float64"),
        ({"d": np.full((1, 1), math.nan, np.float32)}, "a weight of d is not finite"),
    ],
)
def test_cells_that_do_not_fit_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        StateSpace(dataclasses.replace(CELL, **change), 4, 2, ONE)  # type: ignore[arg-type]


GATED_CELL = random_cell(CellShape(4, 5, "gated", factors=1), 3, 2, 0, ROLES)


def test_gated_cells_need_v_and_others_have_none() -> None:
    with refused(ValueError, "'gated' and v is missing"):
        StateSpace(dataclasses.replace(GATED_CELL, v=None), 4, 2, THREE, ROLES)
    with refused(ValueError, "'tanh' and v not missing"):
        StateSpace(dataclasses.replace(CELL, v=np.zeros((5, 3), np.float32)), 4, 2, ONE)
    wrong = dataclasses.replace(GATED_CELL, v=np.zeros((6, 5), np.float32))
    with refused(ValueError, "v of shape (6, 5)", "expected (5, 5)"):
        StateSpace(wrong, 4, 2, THREE, ROLES)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((CELL, 4, 5, ONE), "n_samples = 4, n_out = 5"),
        ((CELL, 4, 0, ONE), "n_out = 0"),
        ((CELL, 4, 2, THREE), r"b of shape \(3, 1\), float32; expected \(3, 3\)"),
        (
            (CELL, 4, 2, THREE, Roles((0,), (0, 1))),
            r"d of shape \(1, 1\), float32; expected \(1, 2\)",
        ),
        ((CELL, 4, 2, THREE, Roles((3,), (0,))), "role of feature 3; there are 3"),
        (
            (CELL, 4, 2, THREE, Roles((0,), (0,), gated=(1,))),
            "tanh units; expected them for gated units",
        ),
        ((CELL, 4, 2, ONE, Roles((0,), (0,), readout=(0,))), "1 rows of c; .* multiple of 2 rows"),
        ((CELL, 4, 2, THREE, Roles((0,), (0,), turn=(1, 2)), 1), "for gated units only"),
        (
            (GATED_CELL, 4, 2, THREE, dataclasses.replace(ROLES, gated=())),
            r"v of shape \(5, 5\), float32; expected \(5, 4\)",
        ),
        ((GATED_CELL, 4, 2, THREE, ROLES, 1), "1 turned pairs of 4 states with 0 features"),
        ((GATED_CELL, 4, 2, THREE, dataclasses.replace(ROLES, turn=(0, 1)), 3), "3 turned pairs"),
        ((GATED_CELL, 4, 2, THREE, dataclasses.replace(ROLES, turn=(0, 1))), "0 turned pairs"),
    ],
)
def test_networks_that_do_not_fit_are_refused(
    arguments: tuple[Cell, int, int, FeatureMap], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        StateSpace(*arguments)


def test_gated_units_see_turned_states_and_push_turned_ones() -> None:
    """Turning the drive, the states and the frame alike turns the response alike."""
    cell = Cell(
        a=0.5 * np.eye(2, dtype=np.float32),
        b=np.eye(2, dtype=np.float32),
        e=0.1 * np.ones((2, 3), np.float32),
        w=np.ones((3, 1), np.float32),
        c=np.eye(2, dtype=np.float32),
        d=np.zeros((2, 0), np.float32),
        d0=np.zeros(2, np.float32),
        activation="gated",
        v=np.array([[1, 0], [0, 1], [1, -1]], np.float32),
    )
    roles = Roles(drive=(0, 1), static=(), turn=(2, 3))
    network = StateSpace(cell, 6, 1, FeatureMap(Differences(4)), roles, 1)
    drive = np.random.default_rng(0).normal(size=(6, 2))
    fixed = network.evaluate(np.hstack([drive, np.tile([1.0, 0.0], (6, 1))])[None])[0]
    c, s = math.cos(0.7), math.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    turned = network.evaluate(np.hstack([drive @ turn.T, np.tile([c, s], (6, 1))])[None])[0]
    assert turned == pytest.approx(turn @ fixed, abs=ROUNDING)
    assert np.max(np.abs(turned - fixed)) > 0.1


def test_sequences_of_another_length_are_refused() -> None:
    with refused(ValueError, "expected (B"):
        network_of(Shape(cell=CellShape())).evaluate(np.zeros((2, 5, 1)))
