"""Outputs before the start that are known: they show the state there, as they do in Python."""

from __future__ import annotations

import ctypes
import math
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.description.variables import AT_STEP_END, HELD, PREHISTORY_KNOWN
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate
from tests.fmu.any_step import both_holds
from tests.fmu.native import DISCARD, ERROR, OK, Load
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate

SLOW = CellShape(contraction=0.97)
"""It forgets its state long after its window."""
SHAPES = {
    "linear": Shape(n_inputs=2, n_in=24, n_out=8, cell=replace(SLOW, units=0)),
    "three_outputs": Shape(
        n_inputs=2, n_outputs=3, n_in=24, n_out=8, cell=replace(SLOW, states=9, units=7)
    ),
    "cell": Shape(n_inputs=1, n_outputs=2, n_in=24, n_out=8, cell=SLOW, seed=5),
    "differences": Shape(n_inputs=2, n_outputs=2, n_in=24, n_out=8, differences=2, cell=SLOW),
    "gated": Shape(
        n_inputs=2, n_outputs=2, n_in=24, n_out=8, cell=replace(SLOW, activation="gated")
    ),
}
ROUNDING = 1e-6
"""Of the largest scaled output: networks run in single precision, in another order of sums, and
keep rounding as long as their states. The first state is found in double precision
(test_sanitized.py)."""
N_KNOWN = 20
YOUNGER = {"zero_order": 4, "first_order": 1}
"""So many samples before the start the younger state of the network begins from zero: not all is
known of these when the start is found, or one of them gives the outputs there."""


def mid_motion(surrogate: Surrogate) -> tuple[FloatArray, FloatArray]:
    """Inputs (N, n_inputs), and outputs (N, n_outputs) after long: a record in mid-motion."""
    network = surrogate.network
    assert isinstance(network, StateSpace)
    rng = np.random.default_rng(2)
    inputs = rng.uniform(0.2, 1, (460, len(surrogate.inputs)))
    features = network.features.along(surrogate.input_scaling.apply(inputs)[None])
    values = network.run(features)[0][0].astype(np.float64)
    noisy = values + 1e-2 * rng.standard_normal(values.shape)
    return inputs[400:], surrogate.output_scaling.invert(noisy)[400:]


def set_window(
    native: Native3,
    surrogate: Surrogate,
    inputs: FloatArray,
    outputs: FloatArray,
    known: float = 3,
) -> int:
    """Set what is known before the start, (K, n_inputs) and (K, n_outputs), K samples of each."""
    variables = {variable.name: variable for variable in fmu_variables(surrogate, 3)}
    names = [f"initial_{s.name}_window" for s in (*surrogate.inputs, *surrogate.outputs)]
    size = surrogate.memory_length
    rows = np.full((len(names), size), np.nan)
    rows[: len(surrogate.inputs)] = 0.1  # does not count
    rows[:, size - len(inputs) :] = np.concatenate([inputs, outputs], axis=1).T
    wanted = [PREHISTORY_KNOWN, *names]
    references = (ctypes.c_uint32 * len(wanted))(*(variables[name].reference for name in wanted))
    values = (ctypes.c_double * (1 + rows.size))(known, *rows.ravel())
    counts = ctypes.c_size_t(len(wanted)), ctypes.c_size_t(len(values))
    return native.call("fmi3SetFloat64", references, counts[0], values, counts[1])


def know_inputs(native: Native3, surrogate: Surrogate) -> None:
    """What is set is all that inputs do."""
    names = {variable.name: variable.reference for variable in fmu_variables(surrogate, 3)}
    reference = names.get(AT_STEP_END, names.get(HELD))
    assert reference is not None
    references, values = (ctypes.c_uint32 * 1)(reference), (ctypes.c_double * 1)(1.0)
    count = ctypes.c_size_t(1)
    assert native.call("fmi3SetFloat64", references, count, values, count) == OK


@both_holds
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_start_with_known_outputs_is_that_of_python(load: Load, shape: Shape, hold: Hold) -> None:
    surrogate = random_surrogate(replace(shape, hold=hold))
    inputs, measured = mid_motion(surrogate)
    known = measured[:N_KNOWN].copy()
    known[3] = np.nan
    known[7, 0] = np.nan
    steps = surrogate.network.memory_length - 1 - YOUNGER[hold]
    expected, _ = surrogate.run_from_outputs(inputs[: N_KNOWN + steps], known)
    native = instance_of(load(surrogate))
    know_inputs(native, surrogate)
    assert set_window(native, surrogate, inputs[:N_KNOWN], known) == OK, native.messages
    native.start()
    first, n, found = len(surrogate.inputs), len(surrogate.outputs), []
    found.append(native.get(first, n))
    for k in range(steps):
        assert native.set(*inputs[N_KNOWN + k]) == native.do_step(k * STEP) == OK, native.messages
        found.append(native.get(first, n))
    scale = surrogate.output_scaling.scale
    size = scale * np.max(np.abs(expected / scale))
    np.testing.assert_allclose(found / size, expected[N_KNOWN - 1 :] / size, atol=ROUNDING, rtol=0)
    without = surrogate.predict(inputs[: N_KNOWN + steps])
    assert np.max(np.abs(without - expected)[N_KNOWN:] / size) > 1e3 * ROUNDING


def test_many_known_samples_count_as_far_as_the_state_is_kept(load: Load) -> None:
    """Only the newest n_in samples: more would be forgotten."""
    surrogate = random_surrogate(replace(SHAPES["cell"], hold="first_order"))
    inputs, measured = mid_motion(surrogate)
    n_in, size = surrogate.window.n_in, surrogate.output_scaling.scale
    assert surrogate.memory_length > n_in
    expected, _ = surrogate.run_from_outputs(inputs[1 : n_in + 1], measured[1 : n_in + 1])
    native = instance_of(load(surrogate))
    count = n_in + 1
    assert set_window(native, surrogate, inputs[:count], measured[:count]) == OK
    native.start()
    found = np.array(native.get(len(surrogate.inputs), 2))
    know_nothing = surrogate.predict(inputs[:count])[-1]
    np.testing.assert_allclose(found / size, expected[-1] / size, atol=ROUNDING, rtol=0)
    assert np.max(np.abs(found - know_nothing) / size) > 1e3 * ROUNDING


@both_holds
def test_filled_parts_say_that_outputs_are_valid_and_bounds_are_not(
    load: Load, hold: Hold
) -> None:
    surrogate = bounded_surrogate(replace(SHAPES["cell"], hold=hold))
    inputs, measured = mid_motion(surrogate)
    native = instance_of(load(surrogate))
    assert set_window(native, surrogate, inputs[:N_KNOWN], measured[:N_KNOWN]) == OK
    native.start()
    names = [variable.name for variable in fmu_variables(surrogate, 3)]
    filled = names.index("window_filled"), names.index("error_bound_filled")
    assert [native.get(place, 1) for place in filled] == [[1.0], [0.0]]


def test_known_outputs_that_are_missing_or_impossible_are_refused(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["cell"])
    inputs, measured = mid_motion(surrogate)
    inputs, measured = inputs[:N_KNOWN], measured[:N_KNOWN]
    native = instance_of(load(surrogate))
    assert set_window(native, surrogate, inputs, measured, known=4) == DISCARD
    assert "expected 0 to 3" in native.messages[-1]
    assert set_window(native, surrogate, inputs, np.full_like(measured, math.inf)) == DISCARD
    assert "= inf; expected finite numbers near the output's range" in native.messages[-1]
    assert set_window(native, surrogate, inputs, np.full_like(measured, np.nan)) == OK
    native.start()
    assert native.do_step(0.0) == ERROR
    assert "initial_<output>_window has no number" in native.messages[-1]
    assert set_window(native, surrogate, inputs, measured) == ERROR
    assert "is a parameter; set it before the end of initialization mode" in native.messages[-1]


def test_steps_between_samples_are_refused_where_outputs_show_the_start(load: Load) -> None:
    surrogate = random_surrogate(SHAPES["cell"])
    inputs, measured = mid_motion(surrogate)
    native = instance_of(load(surrogate))
    assert set_window(native, surrogate, inputs[:N_KNOWN], measured[:N_KNOWN]) == OK
    native.start()
    assert native.set(0.5) == OK
    assert native.do_step(0.0, 0.5 * STEP) == ERROR
    assert "with prehistory_known = 3; expected a multiple of" in native.messages[-1]
    assert native.do_step(0.0, 3 * STEP) == OK


def test_networks_without_a_state_or_with_parameters_know_no_such_start() -> None:
    for shape in (Shape(), Shape(cell=CellShape(parameters=1))):
        surrogate = random_surrogate(shape)
        variables = {variable.name: variable for variable in fmu_variables(surrogate, 3)}
        assert variables[PREHISTORY_KNOWN].high == 2
        assert not any(name == "initial_y0_window" for name in variables)


def test_derivatives_at_the_start_are_those_of_the_found_state(load: Load) -> None:
    """Against differences of whole steps, which the state moves far more than its window does."""
    surrogate = random_surrogate(
        replace(SHAPES["differences"], hold="first_order", forecasts=True)
    )
    inputs, measured = mid_motion(surrogate)
    loaded, n, moved = load(surrogate), 2, 1e-2
    found = []
    for change in (moved, -moved):
        native = instance_of(loaded)
        assert set_window(native, surrogate, inputs[:N_KNOWN], measured[:N_KNOWN]) == OK
        native.start()
        assert native.set(inputs[N_KNOWN][0] + change, inputs[N_KNOWN][1]) == OK
        found.append(np.array(native.get(n, n)))
    native = instance_of(loaded)
    assert set_window(native, surrogate, inputs[:N_KNOWN], measured[:N_KNOWN]) == OK
    native.start()
    assert native.set(*inputs[N_KNOWN]) == OK
    outputs, first = range(n, 2 * n), range(1)
    slopes = native.derivative("fmi3GetDirectionalDerivative", outputs, first, np.ones(1))
    expected = (found[0] - found[1]) / (2 * moved)
    assert np.max(np.abs(expected)) > 0.01
    np.testing.assert_allclose(slopes, expected, rtol=1e-2, atol=1e-3)
