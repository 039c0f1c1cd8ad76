"""Samples before the start that are known: array parameters of FMI 3.0."""

from __future__ import annotations

import ctypes
import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.description.variables import PREHISTORY_KNOWN
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import ESTIMATE_TOLERANCE, FORGETFUL, both_holds
from tests.fmu.future import future
from tests.fmu.native import DISCARD, ERROR, OK, Load
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.plain import ResamplingOracle
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, differences=2, positions=3),
    "long span": Shape(n_inputs=2, n_outputs=2, positions=25, estimator_samples=4),
    "cell": Shape(n_inputs=2, n_outputs=2, differences=1, cell=FORGETFUL, positions=3),
    "director": Shape(n_inputs=2, n_outputs=2, features="director", positions=3),
}
every_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def set_window(native: Native3, surrogate: Surrogate, window: FloatArray, known: float = 2) -> int:
    """Set the samples before the start, (n, n_inputs), and that they are known."""
    names = [variable.name for variable in fmu_variables(surrogate, 3)]
    wanted = [PREHISTORY_KNOWN, *(f"initial_{signal.name}_window" for signal in surrogate.inputs)]
    references = native.places.references(map(names.index, wanted))
    values = (ctypes.c_double * (1 + window.size))(known, *window.T.ravel())
    counts = ctypes.c_size_t(len(wanted)), ctypes.c_size_t(len(values))
    return native.call("fmi3SetFloat64", references, counts[0], values, counts[1])


def get_window(native: Native3, surrogate: Surrogate) -> FloatArray:
    first = [variable.name for variable in fmu_variables(surrogate, 3)].index("initial_u0_window")
    count, n = len(surrogate.inputs), surrogate.memory_length
    references = native.places.references(range(first, first + count))
    values = (ctypes.c_double * (count * n))()
    counts = ctypes.c_size_t(count), ctypes.c_size_t(count * n)
    assert native.call("fmi3GetFloat64", references, counts[0], values, counts[1]) == OK
    return np.array(values).reshape(count, n).T


def window_for(surrogate: Surrogate) -> FloatArray:
    n = surrogate.memory_length
    return np.random.default_rng(4).uniform(0.2, 1, (n, len(surrogate.inputs)))


@both_holds
@every_shape
@pytest.mark.parametrize("lengths", [[1.0], [3.0, 1.0], [0.6, 1.0, 2.3], [40.0, 1.0]])
def test_start_with_an_initial_window_is_as_if_the_fmu_had_run_on_it(
    load: Load, shape: Shape, lengths: list[float], hold: Hold
) -> None:
    """Outputs and estimates at the start and after it, against resampling of window and steps."""
    surrogate = random_surrogate(replace(shape, hold=hold))
    native, oracle, time = instance_of(load(surrogate)), ResamplingOracle(surrogate), 0.0
    window = window_for(surrogate)
    assert set_window(native, surrogate, window) == OK, native.messages
    native.start()
    for row in window:
        expected = oracle.step(STEP, row)
    for row, length in zip(window[:12], (lengths * 12)[:12], strict=True):
        found = np.array(native.get(2, 4))
        np.testing.assert_allclose(found[:2], expected[0], rtol=0, atol=2 * OUTPUT_TOLERANCE * 8)
        np.testing.assert_allclose(found[2:], expected[1], rtol=ESTIMATE_TOLERANCE)
        assert native.get(6, 2) == [1.0, 1.0]  # filled
        assert native.set(*row) == native.do_step(time, length * STEP) == OK, native.messages
        expected = oracle.step(length * STEP, row)
        time += length * STEP
    assert np.array_equal(get_window(native, surrogate), window)


def test_initial_window_that_is_not_switched_on_changes_nothing(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["cell"])
    loaded = load(surrogate)
    native, plain = instance_of(loaded), instance_of(loaded).start()
    assert set_window(native, surrogate, window_for(surrogate), known=0) == OK
    native.start()
    for k in range(5):
        assert native.set(0.3, 0.1 * k) == plain.set(0.3, 0.1 * k) == OK
        assert native.do_step(k * STEP) == plain.do_step(k * STEP) == OK
        assert native.get(2, 6) == plain.get(2, 6)


def test_initial_window_has_the_start_values_of_the_inputs_after_reset_too(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["layers"])
    native = instance_of(load(surrogate)).start()
    starts = [signal.start_value for signal in surrogate.inputs]
    held = np.tile(starts, (surrogate.memory_length, 1))
    assert np.array_equal(get_window(native, surrogate), held)
    native.call("fmi3Reset")
    assert set_window(native, surrogate, window_for(surrogate)) == OK
    native.call("fmi3Reset")
    assert np.array_equal(get_window(native.start(), surrogate), held)


def test_initial_window_of_wrong_counts_or_values_is_refused(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["layers"])
    native, window = instance_of(load(surrogate)), window_for(surrogate)
    for known in (3.0, 0.5, -1.0, math.nan):
        assert set_window(native, surrogate, window, known) == DISCARD
        assert "expected 0 to 2" in native.messages[-1]
    damaged = window.copy()
    damaged[5, 1] = math.inf
    assert set_window(native, surrogate, damaged) == DISCARD
    assert "= inf; expected a finite number" in native.messages[-1]
    assert set_window(native, surrogate, window[1:]) == ERROR
    assert "values for 3 variables; expected" in native.messages[-1]
    native.start()
    assert not np.any(get_window(native, surrogate) == window)
    assert set_window(native, surrogate, window) == ERROR
    assert "is a parameter; set it before the end of initialization mode" in native.messages[-1]


@both_holds
def test_failed_first_step_after_an_initial_window_is_undone(load: Load, hold: Hold) -> None:
    shape = Shape(n_inputs=2, n_outputs=2, cell=CellShape(activation="cubic"), hold=hold)
    surrogate = random_surrogate(shape)
    native = instance_of(load(surrogate))
    assert set_window(native, surrogate, window_for(surrogate)) == OK
    native.start()
    for inputs in ((1e30, 0.0), (0.0, -1e30)):
        assert native.set(*inputs) == OK
        before = native.save()
        expected = future(native, 0.0, (0.1, 0.2), 6)
        for length in (1, 3, 0.6, 50.2):
            assert native.do_step(0.0, length * STEP) == ERROR
            assert future(native, 0.0, (0.1, 0.2), 6) == expected
            assert native.restore(before) == OK


def test_initial_window_with_a_director_of_zero_is_refused(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["director"])
    native, window = instance_of(load(surrogate)), window_for(surrogate)
    window[3] = 0.0
    assert set_window(native, surrogate, window) == OK
    native.start()
    assert native.set(1.0, 0.0) == OK
    assert native.do_step(0.0) == ERROR
    assert "initial window of those with value references 0 and 1 = 0, 0" in native.messages[-1]
