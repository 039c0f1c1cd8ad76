"""Many windows at once on the C kernels: what numpy gives, with every kernel of this processor."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.native import NativeError, NativeSurrogate, kernels
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.refusals import refused
from tests.strategies import all_shapes

SHAPES = [
    Shape(activation="elu", hidden=(40, 33), skip=True, n_inputs=2),
    Shape(activation="relu", hidden=(1,), n_in=1, n_out=1, n_outputs=33),
    Shape(activation="gelu", block=False, hidden=(40,), ages=3, n_outputs=2),
    Shape(activation="tanh", n_in=100, n_out=30, hidden=(200, 180), n_inputs=3),
    Shape(differences=2, n_inputs=3),
    Shape(features="director", n_inputs=2, block=False),
    Shape(cell=CellShape(states=5, units=7), n_inputs=2, differences=1),
    Shape(cell=CellShape(15, 48, "gated", turned=7, factors=4), n_inputs=3, features="chain"),
]


def overlapping(surrogate: Surrogate, count: int = 130) -> FloatArray:
    """Windows of a record, one sample apart, none of them copied."""
    n_in, channels = surrogate.window.n_in, len(surrogate.inputs)
    record = np.random.default_rng(3).uniform(-2, 3, (count + n_in - 1, channels))
    return np.moveaxis(np.lib.stride_tricks.sliding_window_view(record, n_in, axis=0), -1, 1)


def assert_same(found: FloatArray, expected: FloatArray, surrogate: Surrogate) -> None:
    allowed = [OUTPUT_TOLERANCE * (signal.high - signal.low) for signal in surrogate.outputs]
    assert found.shape == expected.shape
    assert np.all(np.abs(found - expected) <= allowed)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_every_kernel_gives_what_numpy_gives(shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    windows = overlapping(surrogate)
    expected = surrogate.predict_windows(windows)
    for kernel in range(len(kernels())):
        native = NativeSurrogate(surrogate, kernel)
        for threads in (1, 3):
            assert_same(native.predict_windows(windows, threads), expected, surrogate)


@given(all_shapes())
def test_prediction_of_windows_of_any_memory_layout_is_the_same(shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    native, windows = NativeSurrogate(surrogate), overlapping(surrogate, 20)
    expected = surrogate.predict_windows(windows)
    for layout in (windows, np.ascontiguousarray(windows), np.asfortranarray(windows)):
        assert_same(native.predict_windows(layout), expected, surrogate)
    assert_same(native.predict_windows(windows[::-1]), expected[::-1], surrogate)
    assert_same(native.predict_windows(windows[::7]), expected[::7], surrogate)
    assert_same(native.predict_windows(windows[:1]), expected[:1], surrogate)
    assert native.predict_windows(windows[:0]).shape == expected[:0].shape
    backwards = surrogate.predict_windows(windows[:, ::-1])
    assert_same(native.predict_windows(windows[:, ::-1]), backwards, surrogate)


def test_prediction_of_windows_of_one_sample_is_that_of_numpy() -> None:
    surrogate = random_surrogate(Shape(n_in=1, n_out=1, n_inputs=2))
    record = np.random.default_rng(3).uniform(-2, 3, (40, 2))
    expected = surrogate.predict_windows(record[:, None])
    for windows in (record[:, None], np.asfortranarray(record)[:, None], record[::-1][:, None]):
        found = NativeSurrogate(surrogate).predict_windows(windows)
        order = slice(None, None, -1) if windows[0, 0, 0] != record[0, 0] else slice(None)
        assert_same(found, expected[order], surrogate)


@pytest.mark.parametrize("cell", [None, CellShape()], ids=["layers", "cells"])
def test_prediction_in_threads_that_share_a_model_is_the_same(cell: CellShape | None) -> None:
    surrogate = random_surrogate(Shape(n_in=200, n_out=50, cell=cell))
    native, windows = NativeSurrogate(surrogate), overlapping(surrogate, 300)
    parts = [windows[first:] for first in range(0, 160, 20)]
    expected = [native.predict_windows(part, 2) for part in parts]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda part: native.predict_windows(part, 2), parts * 4))
    for one, other in zip(found, expected * 4, strict=True):
        assert np.array_equal(one, other)


def test_overlapping_windows_are_not_copied() -> None:
    """A record of a billion bytes as windows, but not in memory."""
    surrogate = random_surrogate(Shape(n_in=100_000, n_out=1, hidden=(1,)))
    windows = overlapping(surrogate, 3000)
    assert windows.size * 4 > 1e9
    assert NativeSurrogate(surrogate).predict_windows(windows).shape == (3000, 1, 1)


def test_bad_windows_are_refused() -> None:
    surrogate = random_surrogate(Shape(n_inputs=2))
    native, windows = NativeSurrogate(surrogate), overlapping(surrogate, 5)
    for bad in (windows[0], windows[:, 1:], windows[..., :1]):
        with refused(ValueError, "expected (B, 12, 2)"):
            native.predict_windows(bad)
    broken = windows.copy()
    broken[4, 3, 1] = np.nan
    with refused(ValueError, "not finite"):
        native.predict_windows(broken)
    with refused(NativeError, "not finite"):
        native.predict_windows(1e39 * np.ones_like(windows))
    with refused(ValueError, "threads 0"):
        native.predict_windows(windows, threads=0)


def test_unknown_kernel_is_refused() -> None:
    with refused(NativeError, "expected one that", "processor supports"):
        NativeSurrogate(random_surrogate(Shape()), kernel=9)
