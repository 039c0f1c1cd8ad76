"""The FMI 2.0 calls of the native library: steps, times, values, and calls that are wrong."""

from __future__ import annotations

import copy
import ctypes
import dataclasses
import itertools
import math
import re
import shutil
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fmu.libraries.build import BINARIES
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import DISCARD, ERROR, OK, Loaded, Native
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate
from tests.fmu.standards import functions

Load = Callable[[Surrogate], Loaded]


def test_step_of_no_positive_finite_length_is_refused(rich: Loaded) -> None:
    native = rich.instance().start()
    native.step(0.1, 0.2)
    saved = native.save()
    for step in (0.0, -0.0, -STEP, math.nan, math.inf, -math.inf):
        assert native.do_step(STEP, step) == ERROR
        assert "expected a positive, finite step" in native.messages[-1]
    assert native.do_step(STEP, 1e-20) == ERROR
    assert "too small to be told apart from zero" in native.messages[-1]
    for step in (1e300, 1e15):
        assert native.do_step(STEP, step) == ERROR
        assert "so far from 0" in native.messages[-1]
    assert native.save() == saved
    assert native.do_step(STEP, STEP * (1 + 1e-9)) == OK


def test_no_step_ends_after_the_stop_time(rich: Loaded) -> None:
    native = rich.instance()
    zero, stop = ctypes.c_double(0), ctypes.c_double(3 * STEP)
    assert native.call("fmi2SetupExperiment", 0, zero, zero, 1, stop) == OK
    assert native.call("fmi2EnterInitializationMode") == OK
    assert native.call("fmi2ExitInitializationMode") == OK
    native.step(0.1, 0.2)
    saved = native.save()
    for length in (2.001, 3, 40):
        assert native.do_step(STEP, length * STEP) == ERROR
        assert f"ends after the stop time {3 * STEP:.9g} s" in native.messages[-1]
        assert native.save() == saved
    assert native.do_step(STEP, 2 * STEP * (1 + 1e-9)) == OK
    assert native.do_step(3 * STEP) == ERROR
    native.call("fmi2Reset")
    native.start()
    for k in range(5):
        assert native.do_step(k * STEP) == OK


def test_stop_time_holds_for_its_own_run_alone(rich: Loaded) -> None:
    """The state at the end of a run begins another one, whatever its stop time."""
    first, zero = rich.instance(), ctypes.c_double(0)
    assert first.call("fmi2SetupExperiment", 0, zero, zero, 1, ctypes.c_double(STEP)) == OK
    first.call("fmi2EnterInitializationMode")
    first.call("fmi2ExitInitializationMode")
    first.step(0.1, 0.2)
    second = rich.instance().start()
    assert second.restore(first.save()) == OK
    for k in range(1, 5):
        assert second.do_step(k * STEP) == OK, second.messages
    assert first.restore(second.save()) == OK
    assert first.do_step(5 * STEP) == ERROR
    assert "ends after the stop time" in first.messages[-1]


@pytest.mark.parametrize("event", [1e-8, 1e-10])
def test_tiny_step_just_before_the_stop_time_is_accepted(load: Load, event: float) -> None:
    """An importer whose time is off by more than such a step."""
    native, count, zero = load(sum_surrogate()).instance(), 200_000, ctypes.c_double(0)
    stop = count * STEP - 1e-7
    assert native.call("fmi2SetupExperiment", 0, zero, zero, 1, ctypes.c_double(stop)) == OK
    native.call("fmi2EnterInitializationMode")
    native.call("fmi2ExitInitializationMode")
    for k in range(count - 1):
        assert native.do_step(k * STEP) == OK
    time = (count - 1) * STEP
    for length in (STEP - event, event):
        assert native.do_step(time, length) == OK, native.messages
        time += length
    assert native.do_step(time, event) == OK
    assert native.do_step(time + event) == ERROR


@pytest.mark.parametrize("interval", [2 * STEP, 0.6 * STEP, 0.1])
def test_step_of_another_length_than_the_window_s_is_accepted(
    rich: Loaded, interval: float
) -> None:
    result = fmpy.simulate_fmu(str(rich.path), stop_time=1.0, output_interval=interval)
    assert result["time"][-1] == pytest.approx(1.0)
    assert result["window_filled"][-1] == 1.0


def test_step_that_does_not_follow_the_last_one_is_refused(rich: Loaded) -> None:
    native = rich.instance().start(10.0)
    for time in (0.0, 10.0 + STEP, 10.0 + 1e-5, math.nan):
        assert native.do_step(time) == ERROR
    assert native.do_step(10.0) == OK
    assert native.do_step(10.0) == ERROR
    assert native.do_step(10.0 + STEP) == OK


def test_summed_times_of_an_importer_are_followed_over_a_long_run(load: Load) -> None:
    """An importer that adds up its own time over a long run is still followed."""
    native = load(sum_surrogate()).instance().start()
    time = 0.0
    for _ in range(1_000_000):
        assert native.do_step(time) == OK
        time += STEP
    assert native.time() == 1_000_000 * STEP


def test_summed_times_of_steps_off_the_grid_are_followed(load: Load) -> None:
    native, odd = load(sum_surrogate()).instance().start(1.0), 0.7 * STEP
    for k in range(10_000):
        assert native.do_step(1.0 + k * odd, odd) == OK
    assert native.do_step(1.0 + 10_000 * odd) == OK
    assert native.time() == 1.0 + 10_000 * odd + STEP


@pytest.mark.parametrize("start", [0.0, 1e8, -1e8])
def test_step_that_was_done_is_refused_the_second_time(load: Load, start: float) -> None:
    step = 1e-3
    window = dataclasses.replace(sum_surrogate().window, step=step)
    surrogate = dataclasses.replace(sum_surrogate(), window=window)
    native = load(surrogate).instance().start(start)
    assert [native.do_step(start, step) for _ in range(3)] == [OK, ERROR, ERROR]
    assert f"point {start:.15g} s; expected {start + step:.15g} s" in native.messages[-1]
    for early_or_late in (0.5, 1.5):
        assert native.do_step(start + early_or_late * step, step) == ERROR
    assert native.do_step(start + 1.1 * step, step) == (OK if start else ERROR)
    assert native.get(2) == [0.5 if start else 0.25]


@pytest.mark.parametrize("start", [0.0, 1e8])
def test_short_step_that_was_done_is_refused_the_second_time(load: Load, start: float) -> None:
    """At large times importers get more slack, but never a whole step."""
    native, step = load(sum_surrogate()).instance().start(start), 0.1 * STEP
    assert [native.do_step(start, step) for _ in range(2)] == [OK, ERROR]
    assert native.do_step(start + step, step) == OK


def test_steps_of_an_importer_that_subtracts_times_are_accepted(load: Load) -> None:
    """Far from 0 each of its steps is rounded otherwise; the time follows all of them."""
    start, odd = 1e7, 0.7 * STEP
    native = load(sum_surrogate()).instance().start(start)
    times = start + odd * np.arange(20_000)
    for time, after in itertools.pairwise(times.tolist()):
        assert native.do_step(time, after - time) == OK
    assert abs(native.time() - times[-1]) < 1e-3 * odd


def test_start_time_too_large_to_resolve_the_step_is_refused(rich: Loaded) -> None:
    native = rich.instance()
    zero = ctypes.c_double(0)
    for start in (1e13, -1e13, 1e16, -1e300):
        time = ctypes.c_double(start)
        assert native.call("fmi2SetupExperiment", 0, zero, time, 0, zero) == ERROR
        assert f"start time {start:.15g} s; expected at most" in native.messages[-1]
    found = re.search(r"at most (\S+) s from 0", native.messages[-1])
    assert found is not None
    largest = 0.99 * float(found[1])
    assert native.start(largest).do_step(largest) == OK


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_input_that_is_not_finite_is_discarded(rich: Loaded, value: float) -> None:
    native = rich.instance().start()
    native.step(0.1, 0.2)
    saved = native.save()
    assert native.set(0.5, value) == DISCARD
    assert "value reference 1" in native.messages[-1]
    assert native.save() == saved


def test_results_that_are_not_finite_are_refused(load: Load) -> None:
    native = load(sum_surrogate()).instance().start()
    native.set(3e38)
    assert native.try_get(1)[0] == DISCARD
    assert native.do_step(0.0) == ERROR
    native.step(1.0)
    native.step(3e38)
    native.set(-1.0)
    assert native.do_step(2 * STEP) == OK
    native.set(3e38)
    before = native.get(1, 2)
    assert native.do_step(3 * STEP) == ERROR
    assert native.get(1, 2) == before
    native.set(-1.0)
    assert native.do_step(3 * STEP) == OK


@pytest.mark.parametrize("means", [False, True])
def test_estimates_that_are_not_finite_count_as_the_largest(load: Load, means: bool) -> None:
    surrogate = random_surrogate(Shape(positions=2, means=means))
    estimator = surrogate.estimator
    assert estimator is not None
    assert isinstance(estimator.network, FeedForward)
    layers = tuple(
        dataclasses.replace(layer, weights=np.float32(1e25) * layer.weights)
        for layer in estimator.network.layers
    )
    network = FeedForward(layers, estimator.network.n_samples, FeatureMap(Differences(1)))
    estimator = dataclasses.replace(estimator, network=network)
    native = load(dataclasses.replace(surrogate, estimator=estimator)).instance().start()
    native.step(1.0)
    largest = 10**estimator.log_error.high * surrogate.output_scaling.scale[0]
    assert native.get(2) == pytest.approx([largest], rel=1e-12)


def test_cells_that_overflow_are_refused_and_go_on(load: Load) -> None:
    surrogate = random_surrogate(Shape(positions=2, cell=CellShape()))
    network = surrogate.network
    assert isinstance(network, StateSpace)
    steep = dataclasses.replace(network.cell, b=1000 * network.cell.b)
    network = StateSpace(steep, network.n_samples, network.n_out, network.features)
    native = load(dataclasses.replace(surrogate, network=network)).instance().start()
    native.step(1.0)
    native.set(3e38)
    before = native.save()
    for length in (STEP, 2 * STEP, 1.5 * STEP):
        status = [native.do_step(STEP, length) for _ in range(2)]
        assert status == [ERROR, ERROR]
        assert native.save() == before
    native.step(1.0)
    assert np.all(np.isfinite(native.get(1, 5)))


@pytest.mark.parametrize("cell", [None, CellShape(units=8, activation="gated", turned=1)])
def test_features_that_are_not_finite_are_refused(load: Load, cell: CellShape | None) -> None:
    """Saturated units would hide them: rates overflow where the inputs do not."""
    shape = Shape(n_inputs=2, features="chain", activation="tanh", positions=2, cell=cell)
    native = load(random_surrogate(shape)).instance().start()
    native.step(0.1, 0.2)
    native.set(3e38, 0.2)
    before = native.get(2, 3)
    for length in (STEP, 2 * STEP, 1.5 * STEP):
        assert native.do_step(STEP, length) == ERROR
        assert "not finite" in native.messages[-1]
        assert native.get(2, 3) == before
    native.step(0.1, 0.2)
    assert np.all(np.isfinite(native.get(2, 3)))


@pytest.mark.parametrize("length", [2 * STEP, 2.5 * STEP, 9 * STEP])
def test_failed_step_leaves_no_trace(load: Load, length: float) -> None:
    """Two samples of the largest float sum to infinity; a bad first step is undone as well."""
    native = load(sum_surrogate()).instance().start()
    fresh = native.save()
    native.set(3e38)
    changed = native.save()
    assert native.do_step(0.0, length) == ERROR
    assert native.save() == changed != fresh
    native.step(1.0)
    native.set(3e38)
    before = native.save()
    assert native.do_step(STEP, length) == ERROR
    assert native.save() == before
    native.set(2.0)
    assert native.do_step(STEP, length) == OK


def _refused(loaded: Loaded, content: bytes) -> str:
    """What the library says about a surrogate file; Python must refuse it, too."""
    with pytest.raises(PayloadError):
        Surrogate.from_bytes(content)
    (loaded.folder / "resources" / "surrogate.slide").write_bytes(content)
    native = loaded.instance()
    assert not native.component.value
    assert len(native.messages) == 1
    return native.messages[0]


def _with_estimator(surrogate: Surrogate, **changes: object) -> bytes:
    """A surrogate file whose estimator was never checked."""
    assert surrogate.estimator is not None
    changed = copy.copy(surrogate)
    estimator = dataclasses.replace(surrogate.estimator, **changes)  # type: ignore[arg-type]
    object.__setattr__(changed, "estimator", estimator)
    return changed.to_bytes()


def test_estimators_of_another_family_are_refused(load: Load) -> None:
    surrogate = random_surrogate(Shape(positions=2, cell=CellShape()))
    message = _refused(load(surrogate), _with_estimator(surrogate, network=surrogate.network))
    assert "estimator is a network of kind 2; expected 1 (feed-forward)" in message


def test_library_refuses_a_file_of_version_4_and_says_how_to_get_another(load: Load) -> None:
    loaded = load(sum_surrogate())
    content = loaded.surrogate.to_bytes()
    body = content[:8] + struct.pack("<I", 4) + content[12:-4]
    old = body + struct.pack("<I", zlib.crc32(body))
    (loaded.folder / "resources" / "surrogate.slide").write_bytes(old)
    native = loaded.instance()
    assert not native.component.value
    assert "of version 4; expected version 5: make the FMU again with" in native.messages[0]


@pytest.mark.parametrize("positions", [0, (1 << 20) + 1, 0xFFFFFFFF])
def test_positions_out_of_range_are_refused(load: Load, positions: int) -> None:
    surrogate = random_surrogate(Shape(positions=2))
    content = _with_estimator(surrogate, positions=positions)
    assert f"at {positions} positions; expected" in _refused(load(surrogate), content)


@pytest.mark.parametrize(
    "ages", [(10, 7, 3), (11, 7, 7), (11, 3, 7), (11, 7, 12), (11, 7, 0xFFFFFFFF)], ids=str
)
def test_ages_that_do_not_fall_are_refused(load: Load, ages: tuple[int, ...]) -> None:
    surrogate = random_surrogate(Shape(n_in=12, ages=3))
    network, content = surrogate.network, surrogate.to_bytes()
    assert isinstance(network, FeedForward)
    right, wrong = (struct.pack("<4I", 3, *row) for row in (network.ages, ages))
    assert content.count(right) == 1
    body = content.replace(right, wrong)[:-4]
    message = _refused(load(surrogate), body + struct.pack("<I", zlib.crc32(body)))
    assert "surrogate file: " in message
    assert "age" in message


def test_unknown_references_and_null_pointers_are_refused(rich: Loaded) -> None:
    native = rich.instance().start()
    assert native.try_get(11)[0] == OK
    assert native.try_get(12)[0] == ERROR
    assert native.set(1.0, first=2) == ERROR
    assert "is no input" in native.messages[-1]
    assert native.set(1.0, first=4_000_000_000) == ERROR
    one = ctypes.c_size_t(1)
    assert native.call("fmi2GetReal", None, one, None) == ERROR
    assert native.call("fmi2SetReal", None, one, None) == ERROR
    assert native.call("fmi2GetReal", None, ctypes.c_size_t(0), None) == OK
    for kind in ("Integer", "Boolean", "String"):
        for verb in ("Get", "Set"):
            assert native.call(f"fmi2{verb}{kind}", None, one, None) == ERROR
            assert native.call(f"fmi2{verb}{kind}", None, ctypes.c_size_t(0), None) == OK
    for function in ("GetFMUstate", "SetFMUstate", "SerializedFMUstateSize"):
        assert native.call(f"fmi2{function}", None, None, None) == ERROR


def test_calls_in_the_wrong_state_are_refused(rich: Loaded) -> None:
    native = rich.instance()
    assert native.do_step(0.0) == ERROR
    assert "instantiated" in native.messages[-1]
    assert native.call("fmi2ExitInitializationMode") == ERROR
    assert native.call("fmi2Terminate") == ERROR
    native.start()
    assert native.call("fmi2EnterInitializationMode") == ERROR
    assert native.call("fmi2Terminate") == OK
    assert native.do_step(0.0) == ERROR
    assert native.set(1.0) == ERROR
    assert native.try_get(2)[0] == OK


def test_all_functions_of_both_standards_are_exported(rich: Loaded) -> None:
    windows = (BINARIES / "x86_64-windows" / "slide.dll").read_bytes()
    arm = (BINARIES / "aarch64-linux" / "slide.so").read_bytes()
    names = functions(2) + functions(3)
    assert len(functions(2)) > 40
    assert len(functions(3)) > 70
    for name in names:
        assert hasattr(rich.library, name)
        assert name.encode() + b"\0" in windows
        assert name.encode() + b"\0" in arm


def test_call_without_an_instance_is_an_error_and_no_crash(rich: Loaded) -> None:
    without = {"fmi2Instantiate", "fmi2FreeInstance", "fmi2GetVersion", "fmi2GetTypesPlatform"}
    for function in set(functions(2)) - without:
        assert getattr(rich.library, function)(*[ctypes.c_void_p()] * 7) == ERROR
    rich.library.fmi2FreeInstance(ctypes.c_void_p())


def test_functions_that_are_not_offered_answer_with_an_error(rich: Loaded) -> None:
    native = rich.instance().start()
    nothing = [ctypes.c_void_p()] * 6
    for function in (
        "fmi2GetRealOutputDerivatives",
        "fmi2CancelStep",
        "fmi2GetStatus",
        "fmi2GetContinuousStates",
        "fmi2EnterEventMode",
    ):
        assert native.call(function, *nothing) == ERROR
        assert native.messages[-1].startswith(function)


def test_debug_logging_reports_calls_while_it_is_on_and_refuses_unknown_categories(
    rich: Loaded,
) -> None:
    native = rich.instance()
    no_categories = (ctypes.c_size_t(0), None)
    native.start()
    assert native.messages == []
    assert native.call("fmi2SetDebugLogging", 1, *no_categories) == OK
    native.call("fmi2Terminate")
    assert native.messages == ["fmi2Terminate"]
    wrong = (ctypes.c_char_p * 1)(b"everything")
    assert native.call("fmi2SetDebugLogging", 1, ctypes.c_size_t(1), wrong) == ERROR


def test_instance_without_callbacks_reports_errors_without_a_crash(rich: Loaded) -> None:
    library = rich.library
    library.fmi2Instantiate.restype = ctypes.c_void_p
    arguments = (b"one", 1, rich.guid.encode(), rich.uri.encode(), None, 0, 1)
    component = ctypes.c_void_p(library.fmi2Instantiate(*arguments))
    assert component.value
    assert library.fmi2DoStep(component, ctypes.c_double(0), ctypes.c_double(1), 0) == ERROR
    library.fmi2FreeInstance(component)


def test_resource_location_is_read_in_every_spelling_of_a_local_uri_and_refused_otherwise(
    rich: Loaded, tmp_path: Path
) -> None:
    odd = tmp_path / "with space, % and ü"
    shutil.copytree(rich.folder / "resources", odd)
    path = str(rich.folder / "resources")
    for uri in (f"file:{path}", f"file://localhost{path}", f"FILE://{path}/", odd.as_uri()):
        assert rich.instance(uri=uri).component.value, uri
    for uri in (path, "", f"http://{path}", f"file://elsewhere{path}", "file:///%zz", "file:///%"):
        native = Native(rich.library, rich.guid, uri)
        assert not native.component.value
        assert len(native.messages) == 1


def test_instantiation_with_a_wrong_guid_or_payload_is_refused(rich: Loaded) -> None:
    assert not rich.instance(guid="other").component.value
    assert "GUID other; expected slide-" in rich.instances[-1].messages[0]
    payload = rich.folder / "resources" / "surrogate.slide"
    payload.write_bytes(payload.read_bytes()[:-5])
    native = rich.instance()
    assert not native.component.value
    assert "checksum" in native.messages[0]
    payload.unlink()
    assert "cannot read" in rich.instance().messages[0]
