"""Gradients of whole records on the C kernels: those of numpy, and central differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native import NativeError, NativeSurrogate, kernels
from slide_fmu.network.state_space.cell import in_double
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.gradient import pull_back_cells
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import Shape, random_surrogate
from tests.fmu.test_native_records import CELLS, SHAPES, records_of
from tests.refusals import refused
from tests.strategies import all_shapes

ROUNDING = 1e-6
"""Of the largest slope: the oracle rounds features to single precision."""
DIFFERENCES = 1e-5
"""Of the largest slope: what central differences over DISTANCE in double precision may miss."""
DISTANCE = 1e-5


def held(surrogate: Surrogate, records: FloatArray) -> FloatArray:
    """Scaled inputs with those before the records, (B, n_in - 1 + N, n_inputs)."""
    lead = ((0, 0), (surrogate.window.n_in - 1, 0), (0, 0))
    return np.pad(surrogate.input_scaling.apply(records), lead, mode="edge")


def slopes_of_numpy(surrogate: Surrogate, records: FloatArray, weights: FloatArray) -> FloatArray:
    network, lead = surrogate.network, surrogate.window.n_in - 1
    assert isinstance(network, StateSpace)
    scaled = held(surrogate, records)
    features = network.features.along(scaled).astype(np.float64)
    of_values = pull_back_cells(network, features, records.shape[1])
    of_inputs = network.features.pull_back(scaled)(
        of_values(weights * surrogate.output_scaling.scale)
    )
    of_inputs[:, lead] += of_inputs[:, :lead].sum(axis=1)
    return np.asarray(of_inputs[:, lead:] / surrogate.input_scaling.scale)


def weighted_sum(surrogate: Surrogate, records: FloatArray, weights: FloatArray) -> float:
    """The sum that is differentiated, all in double precision."""
    network, lead = surrogate.network, surrogate.window.n_in - 1
    assert isinstance(network, StateSpace)
    seen = network.features
    signals = seen.features.along(held(surrogate, records))[:, :, list(seen.chosen)]
    inputs = ByRole.of(network.roles, np.moveaxis(seen.scaling.apply(signals), 1, 0))
    cell = in_double(network.cell)
    first = np.zeros((len(records), len(cell.a)))
    states = Equations(cell, inputs, network.turned, np).run(first)
    values = np.moveaxis(outputs(cell, states, inputs), 0, 1)[:, lead:]
    return float((weights * surrogate.output_scaling.scale * values).sum())


def weights_of(surrogate: Surrogate, records: FloatArray) -> FloatArray:
    shape = (*records.shape[:2], len(surrogate.outputs))
    return np.random.default_rng(11).normal(size=shape)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_every_kernel_gives_the_slopes_of_numpy(shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    records = records_of(surrogate, 9, 70)
    weights = weights_of(surrogate, records)
    expected = slopes_of_numpy(surrogate, records, weights)
    allowed = ROUNDING * np.abs(expected).max()
    for kernel in range(len(kernels())):
        native = NativeSurrogate(surrogate, kernel)
        found = native.vjp(records, weights, threads=1)
        np.testing.assert_allclose(found, expected, rtol=0, atol=allowed)
        assert native.vjp(records, weights, threads=3).tobytes() == found.tobytes()
        alone = native.vjp(records[2], weights[2])
        np.testing.assert_allclose(alone, expected[2], rtol=0, atol=allowed)


def test_slopes_over_several_blocks_are_those_of_numpy() -> None:
    surrogate = random_surrogate(Shape(cell=CELLS["gated"], n_inputs=3, features="chain"))
    for count, length in ((1, 1200), (2, 300)):
        records = records_of(surrogate, count, length)
        weights = weights_of(surrogate, records)
        expected = slopes_of_numpy(surrogate, records, weights)
        found = NativeSurrogate(surrogate).vjp(records, weights)
        allowed = ROUNDING * np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=allowed)


@given(all_shapes().filter(lambda shape: shape.cell is not None), st.integers(1, 40))
def test_slopes_are_central_differences(shape: Shape, length: int) -> None:
    surrogate = random_surrogate(shape)
    records = records_of(surrogate, 2, length)
    weights = weights_of(surrogate, records)
    slopes = NativeSurrogate(surrogate).vjp(records, weights)
    direction = np.random.default_rng(5).normal(size=records.shape)
    there, back = (
        weighted_sum(surrogate, records + sign * DISTANCE * direction, weights) for sign in (1, -1)
    )
    allowed = DIFFERENCES * np.linalg.norm(slopes) * np.linalg.norm(direction)
    assert abs((slopes * direction).sum() - (there - back) / (2 * DISTANCE)) <= allowed


def test_bad_weights_are_refused() -> None:
    surrogate = random_surrogate(Shape(n_inputs=2, n_outputs=3, cell=CELLS["tanh"]))
    native, records = NativeSurrogate(surrogate), records_of(surrogate, 4, 9)
    weights = weights_of(surrogate, records)
    for bad in (weights[0], weights[:, 1:], weights[..., :1], weights[:3]):
        with refused(ValueError, "expected (4, 9, 3)"):
            native.vjp(records, bad)
    with refused(ValueError, "expected (9, 3)"):
        native.vjp(records[0], weights)
    broken = weights.copy()
    broken[3, 8, 1] = np.inf
    with refused(ValueError, "weights hold"):
        native.vjp(records, broken)
    with refused(ValueError, "sequences hold"):
        native.vjp(np.full_like(records, np.nan), weights)
    with refused(ValueError, "threads 0"):
        native.vjp(records, weights, threads=0)
    assert native.vjp(records[:0], weights[:0]).shape == (0, 9, 2)


def test_slopes_of_layers_are_refused_with_what_to_use() -> None:
    surrogate = random_surrogate(Shape())
    records = records_of(surrogate, 1, 9)
    with refused(NativeError, "FeedForward", "use slide_fmu.gradient"):
        NativeSurrogate(surrogate).vjp(records, weights_of(surrogate, records))


def test_slopes_of_features_beyond_double_precision_are_refused() -> None:
    surrogate = random_surrogate(Shape(cell=CELLS["tanh"], n_inputs=2, differences=2))
    records = np.where(np.arange(9)[:, None] % 2, 1e308, -1e308) * np.ones((1, 9, 2))
    with refused(NativeError, "not finite"):
        NativeSurrogate(surrogate).vjp(records, weights_of(surrogate, records))
