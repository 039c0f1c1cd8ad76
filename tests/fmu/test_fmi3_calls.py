"""The FMI 3.0 calls of the native library: as in FMI 2.0, and what the standard has of its own."""

from __future__ import annotations

import ctypes
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.fmu.derivatives import derivatives
from tests.fmu.native import DISCARD, ERROR, OK, ExportedFmu, Load
from tests.fmu.native3 import NO, Native3, instance_of, with_separator
from tests.fmu.places import first_of
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate

SHAPES = [
    Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3),
    Shape(n_inputs=2, positions=3, hold="first_order", cell=CellShape(9, 17)),
]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_results_of_fmi_3_are_those_of_fmi_2_to_the_bit(load: Load, shape: Shape) -> None:
    loaded = load(random_surrogate(shape))
    two, three = loaded.instance().start(), instance_of(loaded).start()
    rng, time = np.random.default_rng(1), 0.0
    for length in rng.choice([STEP, 2 * STEP, 0.6 * STEP], 60).tolist():
        inputs = rng.uniform(-2, 3, shape.n_inputs).tolist()
        assert two.set(*inputs) == three.set(*inputs) == OK
        assert two.do_step(time, length) == three.do_step(time, length) == OK
        time += length
        count = 2 * shape.n_outputs + 2
        assert two.get(shape.n_inputs, count) == three.get(shape.n_inputs, count)
    assert two.save() == three.save()


def test_state_saved_by_one_standard_is_restored_by_the_other(rich: ExportedFmu) -> None:
    two, three, again = rich.instance().start(), instance_of(rich).start(), instance_of(rich)
    two.step(0.3, 0.1)
    assert three.restore(two.save()) == again.restore(two.save()) == OK
    two.step(0.2, -0.4)
    assert three.set(0.2, -0.4) == three.do_step(STEP) == OK
    assert two.get(2, 6) == three.get(2, 6)
    assert two.save() == three.save() != again.save()
    assert three.restore(b"SLIDEST") == ERROR
    assert three.messages[-1].startswith("fmi3DeserializeFMUState: 7 bytes; expected ")


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_derivatives_of_fmi_3_are_those_of_fmi_2_to_the_bit(load: Load, shape: Shape) -> None:
    """The same bits; adjoint ones are the same matrix from the other side."""
    loaded = load(random_surrogate(shape))
    two, three = loaded.instance().start(), instance_of(loaded).start()
    n, m, rng = shape.n_inputs, shape.n_outputs, np.random.default_rng(4)
    knowns, unknowns = range(n), range(n, n + m)
    for index, length in enumerate([STEP, STEP, 2 * STEP, 0.6 * STEP, STEP]):
        inputs, time = rng.uniform(-1, 1, n).tolist(), 0.0 if index == 0 else two.time()
        assert two.set(*inputs) == three.set(*inputs) == OK
        assert two.do_step(time, length) == three.do_step(time, length) == OK
        expected = derivatives(two, n, m)
        found = [
            three.derivative("fmi3GetDirectionalDerivative", unknowns, knowns, seed)
            for seed in np.eye(n)
        ]
        assert np.array_equal(np.stack(found, axis=1), expected)
        weights = rng.normal(size=m)
        adjoint = three.derivative("fmi3GetAdjointDerivative", unknowns, knowns, weights)
        np.testing.assert_allclose(adjoint, weights @ expected, rtol=1e-12, atol=1e-15)


def test_derivatives_with_wrong_counts_are_refused(rich: ExportedFmu) -> None:
    native, one = instance_of(rich).start(), (ctypes.c_double * 2)()
    knowns, unknowns = map(native.places.references, ([0, 1], [2]))
    counts = unknowns, ctypes.c_size_t(1), knowns, ctypes.c_size_t(2)
    few = one, ctypes.c_size_t(1)
    assert native.call("fmi3GetDirectionalDerivative", *counts, *few, *few) == ERROR
    assert "1 seeds and 1 sensitivities; expected 2 and 1" in native.messages[-1]
    assert native.call("fmi3GetAdjointDerivative", *counts, *few, *few) == ERROR
    assert "1 seeds and 1 sensitivities; expected 1 and 2" in native.messages[-1]


def test_time_of_the_instance_can_be_read_as_a_variable(rich: ExportedFmu) -> None:
    native, time = instance_of(rich), first_of(rich.surrogate, "TIME")
    assert native.initialize(2.0) == OK
    assert native.get(time) == [2.0]
    assert native.call("fmi3ExitInitializationMode") == OK
    assert native.do_step(2.0) == OK
    assert native.get(time) == [2.0 + STEP]
    assert native.set(1.0, first=time) == ERROR
    assert "is no input" in native.messages[-1]
    assert native.try_get(time + 1)[0] == ERROR


def test_step_reports_the_time_at_which_it_ended(rich: ExportedFmu) -> None:
    native = instance_of(rich).start(1.0)
    assert native.do_step(1.0) == OK
    assert (native.last, native.flags) == (1.0 + STEP, (False, False, False))
    for step in (0.0, -STEP, math.nan):
        assert native.do_step(1.0 + STEP, step) == ERROR
        assert (native.last, native.flags) == (1.0 + STEP, (False, False, False))
    assert native.do_step(1.0) == ERROR
    saved = native.save()
    zero = ctypes.c_double(0)
    assert native.call("fmi3DoStep", zero, zero, NO, None, None, None, None) == ERROR
    assert native.messages[-1].startswith("fmi3DoStep: an argument is NULL")
    assert native.save() == saved


def test_call_with_another_count_of_values_than_variables_is_refused(rich: ExportedFmu) -> None:
    native = instance_of(rich).start()
    assert native.set(0.1, 0.2, count=1) == ERROR
    assert "1 values for 2 variables" in native.messages[-1]
    assert native.set(0.1, math.nan) == DISCARD
    assert native.set(0.1, 0.2) == OK


def test_start_and_stop_time_bound_the_steps(rich: ExportedFmu) -> None:
    native = instance_of(rich)
    for start, stop in ((math.nan, None), (2.0, 1.0), (1e16, None)):
        assert native.initialize(start, stop) == ERROR
    assert native.initialize(1.0, 2.0) == OK
    assert native.initialize(1.0) == ERROR
    assert native.call("fmi3ExitInitializationMode") == OK
    assert native.call("fmi3Terminate") == OK
    assert native.do_step(1.0) == ERROR
    assert native.call("fmi3Reset") == OK
    assert native.initialize(1.0, 1.0 + STEP) == OK
    assert native.call("fmi3ExitInitializationMode") == OK
    assert native.do_step(1.0) == OK
    assert native.do_step(1.0 + STEP) == ERROR
    assert "ends after the stop time" in native.messages[-1]
    assert native.call("fmi3Reset") == OK
    assert native.start().do_step(0.0) == OK


def test_resource_path_with_and_without_a_slash_is_read(rich: ExportedFmu, tmp_path: Path) -> None:
    odd = tmp_path / "with space, %41 # and ü"
    shutil.copytree(rich.folder / "resources", odd)
    for path in (str(odd), with_separator(odd)):
        assert Native3(rich.library, rich.guid, path).component.value, path
    for path, message in ((None, "is NULL"), (tmp_path / "100 %", "cannot read")):
        native = Native3(rich.library, rich.guid, path)
        assert not native.component.value
        assert message in native.messages[0]
    assert "100 %/" in native.messages[0]  # no printf format: signs stay as they are


def test_instantiation_with_wrong_arguments_is_refused(rich: ExportedFmu) -> None:
    native = Native3(rich.library, "other", rich.folder / "resources")
    assert not native.component.value
    assert "GUID other; expected slide-" in native.messages[0]
    events = instance_of(rich, events=True)
    assert not events.component.value
    assert "eventModeUsed is true; expected false" in events.messages[0]
    for kind, more in (("ModelExchange", ()), ("ScheduledExecution", (None, None, None))):
        messages = events.messages = []
        place = str(rich.folder / "resources").encode()
        function = getattr(rich.library, f"fmi3Instantiate{kind}")
        function.restype = ctypes.c_void_p
        arguments = (b"one", rich.guid.encode(), place, NO, NO, None, events._logger, *more)
        assert function(*arguments) is None
        assert "this FMU is for co-simulation" in messages[0]


def test_version_is_that_of_the_standard(rich: ExportedFmu) -> None:
    library = rich.library  # each access loads it anew
    library.fmi3GetVersion.restype = ctypes.c_char_p
    assert library.fmi3GetVersion() == b"3.0"


def test_variables_of_other_types_are_refused(rich: ExportedFmu) -> None:
    native = instance_of(rich).start()
    for kind in ("Float32", "Int32", "UInt64", "String"):
        for verb in ("Get", "Set"):
            for count, status in ((0, OK), (1, ERROR)):
                n = ctypes.c_size_t(count)
                assert native.call(f"fmi3{verb}{kind}", None, n, None, n) == status
    one = ctypes.c_size_t(1)
    assert native.call("fmi3GetBinary", None, one, None, None, one) == ERROR
    assert native.call("fmi3GetClock", None, one, None) == ERROR
    assert native.call("fmi3GetIntervalDecimal", None, one, None, None) == ERROR


def test_debug_logging_reports_calls_while_it_is_on(rich: ExportedFmu) -> None:
    native = instance_of(rich, logging=True)
    assert native.messages[0].startswith("instantiated, window of ")
    native.start()
    assert native.messages[1:] == ["fmi3EnterInitializationMode", "fmi3ExitInitializationMode"]
    assert native.call("fmi3SetDebugLogging", NO, ctypes.c_size_t(0), None) == OK
    assert native.call("fmi3Terminate") == OK
    assert len(native.messages) == 3
