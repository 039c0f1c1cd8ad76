"""Whole records on the C kernels: what numpy gives, with every kernel of this processor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native import NativeError, NativeSurrogate, kernels
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import SEEN, CellShape, Shape, random_surrogate
from tests.fmu.test_native import assert_same
from tests.refusals import refused
from tests.strategies import all_shapes

CELLS = {
    "tanh": CellShape(states=5, units=7),
    "cubic": CellShape(states=9, units=17, activation="cubic"),
    "mixed": CellShape(states=3, units=11, activation="mixed", substeps=3),
    "gated": CellShape(15, 48, "gated", turned=7, factors=4),
    "linear": CellShape(states=2, units=0),
    "parameters": CellShape(2, 3, parameters=2),
    "roles": CellShape(states=9, units=9, roles=True, factors=3),
}
SHAPES = [
    Shape(cell=cell, n_outputs=2, **seen) for cell in CELLS.values() for seen in SEEN.values()
]


def records_of(surrogate: Surrogate, count: int, length: int) -> FloatArray:
    shape = (count, length, len(surrogate.inputs))
    return np.random.default_rng(7).uniform(-2, 3, shape)


def one_state(surrogate: Surrogate, records: FloatArray) -> FloatArray:
    """Outputs (B, N, n_outputs) of one run over records that were held before."""
    network, lead = surrogate.network, surrogate.window.n_in - 1
    assert isinstance(network, StateSpace)
    scaled = surrogate.input_scaling.apply(records)
    held = np.pad(scaled, ((0, 0), (lead, 0), (0, 0)), mode="edge")
    values, _ = network.run(network.features.along(held))
    return surrogate.output_scaling.invert(values[:, lead:].astype(np.float64))


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_every_kernel_gives_the_records_of_numpy(shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    records = records_of(surrogate, 37, 21)
    expected = one_state(surrogate, records)
    for kernel in range(len(kernels())):
        native = NativeSurrogate(surrogate, kernel)
        found = native.predict(records, threads=1)
        assert_same(found, expected, surrogate)
        for threads in (2, 5):
            assert native.predict(records, threads).tobytes() == found.tobytes()
        alone = [native.predict(record) for record in records[:2]]
        assert np.array(alone).tobytes() == found[:2].tobytes()


@given(all_shapes(), st.integers(1, 300))
def test_record_of_any_surrogate_begins_as_the_stream(shape: Shape, length: int) -> None:
    surrogate = random_surrogate(shape)
    records = records_of(surrogate, 2, length)
    found = NativeSurrogate(surrogate).predict(records)
    exact = length
    if isinstance(surrogate.network, StateSpace):
        assert_same(found, one_state(surrogate, records), surrogate)
        exact = shape.n_in - shape.n_out + 1
    stream = surrogate.predict_newest_batch(records)
    assert_same(found[:, :exact], stream[:, :exact], surrogate)


@pytest.mark.parametrize("cell", CELLS.values(), ids=CELLS.keys())
def test_record_as_long_as_the_window_is_the_stream(cell: CellShape) -> None:
    """The window of this surrogate is longer than the memory of its cell."""
    surrogate = random_surrogate(Shape(n_in=60, n_out=20, cell=cell, n_inputs=2, differences=1))
    records = records_of(surrogate, 3, 200)
    found = NativeSurrogate(surrogate).predict(records)
    assert_same(found, surrogate.predict_newest_batch(records), surrogate)


def test_more_samples_than_a_block_give_what_numpy_gives() -> None:
    surrogate = random_surrogate(Shape(cell=CellShape(), n_inputs=3, features="chain"))
    records = records_of(surrogate, 1, 1000)
    expected = one_state(surrogate, records)
    assert_same(NativeSurrogate(surrogate).predict(records), expected, surrogate)
    assert_same(NativeSurrogate(surrogate).predict(records[0]), expected[0], surrogate)


@pytest.mark.parametrize("cell", [None, CellShape()], ids=["layers", "cells"])
def test_bad_records_are_refused(cell: CellShape | None) -> None:
    surrogate = random_surrogate(Shape(n_inputs=2, cell=cell))
    native, records = NativeSurrogate(surrogate), records_of(surrogate, 4, 9)
    for bad in (records[0, 0], records[..., :1], records[:, :0], records[None]):
        with refused(ValueError, "expected (B, N, 2)"):
            native.predict(bad)
    broken = records.copy()
    broken[3, 8, 1] = np.nan
    with refused(ValueError, "not finite"):
        native.predict(broken)
    with refused(NativeError, "a feature of the"):
        native.predict(1e39 * np.ones_like(records))
    with refused(ValueError, "threads 0"):
        native.predict(records, threads=0)
    assert native.predict(records[:0]).shape == (0, 9, 1)


def test_unsettled_cells_are_run_as_long_as_the_window() -> None:
    """A cell that hardly contracts is not at rest after the held inputs."""
    cell = CellShape(contraction=0.999)
    surrogate = random_surrogate(Shape(n_in=40, n_out=10, cell=cell))
    records = records_of(surrogate, 2, 5)
    assert_same(
        NativeSurrogate(surrogate).predict(records), one_state(surrogate, records), surrogate
    )
    other = random_surrogate(replace(Shape(n_in=41, n_out=10, cell=cell)))
    assert np.any(NativeSurrogate(other).predict(records) != one_state(surrogate, records))


@pytest.mark.parametrize("cell", CELLS.values(), ids=CELLS.keys())
def test_record_has_the_same_bits_in_a_batch_of_any_size(cell: CellShape) -> None:
    """However many records go together: 1, 4, 8, 16 or 32 of them."""
    surrogate = random_surrogate(Shape(cell=cell, n_outputs=2, n_inputs=2, differences=1))
    records = records_of(surrogate, 40, 9)
    for kernel in range(len(kernels())):
        native = NativeSurrogate(surrogate, kernel)
        alone = np.array([native.predict(record) for record in records])
        for count in range(1, len(records) + 1):
            found = native.predict(records[:count], threads=1)
            assert found.tobytes() == alone[:count].tobytes()
