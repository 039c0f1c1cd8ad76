"""The arrays of FMI 3.0: the samples of the outputs that the network knows at a time."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.surrogate_variables import block_size, fmu_variables
from slide_fmu.fmu.export import export_fmu
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import FORGETFUL, LASTING, drawn
from tests.fmu.native import DISCARD, ERROR, OK, ExportedFmu, Load
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.places import first_of
from tests.fmu.plain import ResamplingOracle
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate

SHAPES = {
    "block": Shape(n_inputs=2, n_outputs=3, n_out=5, positions=2),
    "linear": Shape(n_inputs=2, n_outputs=2, hidden=(), skip=True),
    "deep, skip": Shape(n_inputs=2, n_outputs=30, hidden=(9, 40, 7), skip=True),
    "skip": Shape(n_inputs=2, n_outputs=2, skip=True),
    "ages": Shape(n_inputs=2, n_outputs=2, ages=3),
    "cell": Shape(n_inputs=2, n_outputs=2, cell=LASTING, n_out=5),
    "gated": Shape(
        n_inputs=2, n_outputs=2, cell=CellShape(9, 9, "gated", 0.7, turned=2, factors=2)
    ),
}
both_families = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def windows(native: Native3, surrogate: Surrogate) -> FloatArray:
    """All windows, (n_out, n_outputs)."""
    first, count = first_of(surrogate, "OUTPUT_WINDOW"), block_size(surrogate)
    m = len(surrogate.outputs)
    values = (ctypes.c_double * (m * count))()
    references = native.places.references(range(first, first + m))
    n = (ctypes.c_size_t(m), values, ctypes.c_size_t(m * count))
    assert native.call("fmi3GetFloat64", references, *n) == OK, native.messages
    return np.array(values).reshape(m, count).T


@both_families
def test_output_window_is_that_which_the_network_predicts(load: Load, shape: Shape) -> None:
    """As predict_windows gives it, after single steps, several at once and others; its newest
    sample is the output, to the bit."""
    surrogate = random_surrogate(shape)
    native, n = instance_of(load(surrogate)).start(), surrogate.window.n_in
    lengths = [1] * 30 + [2] * 20 + [1, 3, 1, 1]
    record = []
    for row, length in zip(drawn(len(lengths), 2), lengths, strict=True):
        assert native.set(*row) == native.do_step(len(record) * STEP, length * STEP) == OK
        record += [row] * length
        found = windows(native, surrogate)
        assert found[-1].tolist() == native.get(2, shape.n_outputs)
        if len(record) < 2 * n:
            continue
        expected = surrogate.predict_windows(np.array(record[-n:])[None])[0]
        if shape.cell is None:
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)


def test_output_window_of_a_cell_after_several_samples_is_that_of_single_steps(load: Load) -> None:
    """A step of five samples gives what five single steps give."""
    surrogate = random_surrogate(SHAPES["cell"])
    loaded = load(surrogate)
    whole, single = instance_of(loaded).start(), instance_of(loaded).start()
    for k, row in enumerate(drawn(20, 2)):
        assert whole.set(*row) == single.set(*row) == OK
        assert whole.do_step(5 * k * STEP, 5 * STEP) == OK
        outputs = []
        for i in range(5):
            assert single.do_step((5 * k + i) * STEP) == OK
            outputs.append(single.get(2, 2))
        assert windows(whole, surrogate).tolist() == outputs


def test_output_window_after_a_step_off_the_grid_ends_with_the_step(load: Load) -> None:
    """Of a cell that forgets within its window, held inputs."""
    shape = Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL, n_out=3)
    surrogate = random_surrogate(shape)
    native = instance_of(load(surrogate)).start()
    rows, oracle = drawn(40, 2), ResamplingOracle(surrogate)
    for k, row in enumerate(rows):
        assert native.set(*row) == native.do_step(0.5 * k * STEP, 0.5 * STEP) == OK
        oracle.append(0.5 * STEP, row)
    expected = surrogate.predict_windows(oracle.samples(surrogate.window.n_in)[None])[0]
    np.testing.assert_allclose(windows(native, surrogate), expected, rtol=0, atol=1e-4)


@both_families
def test_output_window_before_the_first_step_is_that_of_held_inputs(
    load: Load, shape: Shape
) -> None:
    surrogate = random_surrogate(shape)
    native = instance_of(load(surrogate))
    assert native.initialize() == native.set(0.3, 0.4) == OK
    found = windows(native, surrogate)
    newest = native.get(2, shape.n_outputs)
    assert found[-1].tolist() == newest
    if shape.cell:  # has not forgotten quite yet that it began at zero
        np.testing.assert_allclose(found, np.broadcast_to(newest, found.shape), atol=0.04)
    else:
        held = np.tile([0.3, 0.4], (1, surrogate.window.n_in, 1))
        np.testing.assert_allclose(found, surrogate.predict_windows(held)[0], atol=1e-5)


@both_families
def test_output_window_that_is_read_changes_nothing(load: Load, shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    loaded = load(surrogate)
    native, other = instance_of(loaded).start(), instance_of(loaded).start()
    for k, row in enumerate(drawn(15, 2)):
        assert native.set(*row) == native.do_step(k * STEP) == OK
        found = windows(native, surrogate)
        assert other.restore(native.save()) == OK
        assert np.array_equal(windows(other, surrogate), found)
        assert native.save() == other.save()


@both_families
def test_failed_step_leaves_output_windows(load: Load, shape: Shape) -> None:
    """Also the derivatives, which look at the same window."""
    surrogate = random_surrogate(shape)
    native, m = instance_of(load(surrogate)).start(), shape.n_outputs
    for k, row in enumerate(drawn(15, 2)):
        assert native.set(*row) == native.do_step(k * STEP) == OK
    knowns, unknowns, seed = range(2), range(2, 2 + m), np.array([1.0, -0.5])
    name = "fmi3GetDirectionalDerivative"
    before = windows(native, surrogate), native.derivative(name, unknowns, knowns, seed)
    assert native.set(3e38, -3e38) == OK
    saved = native.save()
    for length in (1, 2, 1.3):
        assert native.do_step(15 * STEP, length * STEP) in (OK, ERROR)
        if native.last > 15.5 * STEP:  # a cell that saturates gives outputs
            assert native.restore(saved) == OK
        assert np.array_equal(windows(native, surrogate), before[0])
        assert np.array_equal(native.derivative(name, unknowns, knowns, seed), before[1])


def test_output_window_with_samples_that_are_not_finite_is_refused(load: Load) -> None:
    """Where the newest one is, the output."""
    surrogate = random_surrogate(Shape(n_outputs=1, n_out=3))
    network = surrogate.network
    assert isinstance(network, FeedForward)
    *first, last = network.layers
    larger = np.float32([[1e37], [1e37], [1.0]]) * last.weights
    layers = (*first, replace(last, weights=larger))
    changed = FeedForward(layers, network.n_samples, network.features)
    native = instance_of(load(replace(surrogate, network=changed))).start()
    place = first_of(surrogate, "OUTPUT_WINDOW")
    values, reference = (ctypes.c_double * 3)(), native.places.references([place])
    arguments = reference, ctypes.c_size_t(1), values, ctypes.c_size_t(3)
    assert native.call("fmi3GetFloat64", *arguments) == OK
    assert native.set(1e3) == native.do_step(0.0) == OK
    saved, output = native.save(), native.get(1)
    assert np.isfinite(output[0])
    assert native.call("fmi3GetFloat64", *arguments) == DISCARD
    assert f"the array with value reference {reference[0]} holds numbers" in native.messages[-1]
    assert native.save() == saved


def test_networks_of_one_sample_have_no_output_windows() -> None:
    one_sample = random_surrogate(Shape(block=False))
    assert block_size(one_sample) == 1
    names = [v.name for v in fmu_variables(one_sample, 3)]
    assert names[-3:] == ["time", "initial_u0_window", "inputs_held"]
    names = [v.name for v in fmu_variables(random_surrogate(Shape()), 3)]
    assert names[-4:] == ["time", "y0_window", "initial_u0_window", "inputs_held"]


def test_output_window_read_with_a_wrong_count_is_refused(rich: ExportedFmu) -> None:
    native, time = instance_of(rich).start(), first_of(rich.surrogate, "TIME")
    references = native.places.references([time, time + 1])
    values = (ctypes.c_double * 5)(*[-7.0] * 5)
    for count, status in ((4, ERROR), (2, ERROR), (5, OK)):
        arguments = references, ctypes.c_size_t(2), values, ctypes.c_size_t(count)
        assert native.call("fmi3GetFloat64", *arguments) == status
        assert status == OK or list(values) == [-7.0] * 5
    assert f"{2} values for 2 variables; expected 5" in native.messages[-1]
    assert native.call("fmi3SetFloat64", references, 2, values, ctypes.c_size_t(5)) == ERROR
    assert "is no input" in native.messages[-1]
    assert native.try_get(len(fmu_variables(rich.surrogate, 3)))[0] == ERROR
    assert "expected one of modelDescription.xml" in native.messages[-1]


def test_fmpy_records_output_windows_when_asked_to_alone(tmp_path: Path) -> None:
    """fmpy records them when it is asked to, and not otherwise."""
    surrogate = random_surrogate(SHAPES["block"])
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=3)
    assert validate_fmu(str(path)) == []
    plain = fmpy.simulate_fmu(str(path), stop_time=40 * STEP, output_interval=STEP)
    assert not any(name.endswith("_window") for name in plain.dtype.names)
    names = ["y0", "y0_window"]
    result = fmpy.simulate_fmu(str(path), stop_time=40 * STEP, output_interval=STEP, output=names)
    assert result["y0_window"].shape == (len(result), 5)
    assert np.array_equal(result["y0_window"][:, -1], result["y0"])
