"""The FMI 2.0 behaviour of the native library: windows, states, bad calls."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.fmu.build import BINARIES
from slide_fmu.surrogate import Surrogate

from .native import DISCARD, ERROR, OK, Loaded, Native
from .samples import STEP, Shape, random_surrogate, sum_surrogate

Load = Callable[[Surrogate], Loaded]


@pytest.fixture
def summing(load: Load) -> Native:
    """A window of 4, y = sum, whose window holds zeros after one step."""
    native = load(sum_surrogate()).instance().start()
    native.step(0.0)
    return native


@pytest.fixture
def rich(load: Load) -> Loaded:
    shape = Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3)
    return load(random_surrogate(shape))


def test_window_set_step_get(summing: Native) -> None:
    results = []
    for _ in range(6):
        summing.step(1.0)
        results += summing.get(1)
    assert results == [1, 2, 3, 4, 4, 4]


def test_window_set_once(summing: Native) -> None:
    summing.set(1.0)
    results = []
    for _ in range(6):
        summing.step()
        results += summing.get(1)
    assert results == [1, 2, 3, 4, 4, 4]


def test_window_get_once_at_the_end(summing: Native) -> None:
    for _ in range(4):
        summing.step(1.0)
    assert summing.get(1) == [4]


def test_window_advances_with_steps_only(summing: Native) -> None:
    for _ in range(3):
        summing.set(1.0)
        assert summing.get(1) == [0]
    summing.step()
    assert summing.get(1) == [1]


def test_window_after_rollback(summing: Native) -> None:
    saved = summing.save()
    for _ in range(2):
        assert summing.restore(saved) == OK
        summing.steps = 1
        test_window_set_step_get(summing)


def test_prehistory_is_the_first_input(load: Load) -> None:
    native = load(sum_surrogate()).instance().start()
    native.set(0.5)
    assert native.get(1, 2) == [2.0, 0.0]
    native.set(0.25)
    assert native.get(1, 2) == [1.0, 0.0]
    native.step(1.0)
    assert native.get(1, 2) == [4.0, 0.25]
    filled = []
    for _ in range(4):
        native.step(0.0)
        filled += native.get(2)
    assert filled == [0.5, 0.75, 1.0, 1.0]


def test_error_estimates_fill_by_their_own_window(load: Load) -> None:
    """The network sees 9 samples, the estimator 10 at each of 3 positions."""
    surrogate = random_surrogate(Shape(n_in=12, n_out=4, block=False, positions=3))
    native = load(surrogate).instance().start()
    assert native.get(3, 2) == [0, 0]
    for steps in range(1, 16):
        native.step(0.1)
        assert native.get(3, 2) == [min(1, steps / 9), min(1, steps / 12)]
    assert native.try_get(5)[0] == ERROR


def test_outputs_in_initialization_mode(load: Load) -> None:
    native = load(sum_surrogate()).instance()
    assert native.try_get(1)[0] == ERROR
    native.call("fmi2EnterInitializationMode")
    native.set(2.0)
    assert native.get(1) == [8.0]


def test_reset_gives_a_fresh_instance(rich: Loaded) -> None:
    fresh = rich.instance()
    used = rich.instance().start(7.0)
    used.set(0.3, 0.4)
    assert used.do_step(7.0) == OK
    assert used.call("fmi2Reset") == OK
    assert used.save() == fresh.save()


def test_state_is_bit_exact_in_another_instance(rich: Loaded) -> None:
    rng = np.random.default_rng(1)
    one, other = rich.instance().start(), rich.instance()
    for row in rng.uniform(-1, 1, (20, 2)):
        one.step(*row)
    saved = one.save()
    assert other.restore(saved) == OK
    other.steps = one.steps
    assert other.save() == saved
    for row in rng.uniform(-1, 1, (20, 2)):
        one.step(*row)
        other.step(*row)
        assert one.get(0, 8) == other.get(0, 8)
    assert one.save() == other.save()


def test_damaged_states_are_refused(rich: Loaded) -> None:
    native = rich.instance().start()
    native.step(0.1, 0.2)
    saved = native.save()
    rng = np.random.default_rng(2)
    damaged = [saved[:-1], saved + b"\0", saved[:10], b""]
    for position in [*range(64), *rng.integers(80, len(saved), 100)]:
        changed = bytearray(saved)
        changed[position] ^= 1 << int(rng.integers(8))
        damaged.append(bytes(changed))
    for blob in damaged:
        native.messages.clear()
        assert native.restore(blob) == ERROR
        assert len(native.messages) == 1
    assert native.save() == saved


def test_state_of_another_surrogate_is_refused(load: Load) -> None:
    one = load(random_surrogate(Shape(name="first", seed=1))).instance()
    two = load(random_surrogate(Shape(name="second", seed=2))).instance()
    assert two.restore(one.save()) == ERROR
    assert "another FMU" in two.messages[-1]


def test_instances_and_fmus_are_independent(load: Load) -> None:
    """Two different FMUs and two instances of each, stepped in turn, as if each were alone."""
    loaded = [
        load(random_surrogate(Shape(name="first", n_in=9, seed=1))),
        load(random_surrogate(Shape(name="second", n_in=14, activation="tanh", seed=2))),
    ]
    natives = [fmu.instance().start() for fmu in loaded for _ in range(2)]
    streams = [fmu.surrogate.stream() for fmu in loaded for _ in range(2)]
    rng = np.random.default_rng(3)
    for _ in range(20):
        for native, stream in zip(natives, streams, strict=True):
            value = rng.uniform(-2, 3)
            native.step(value)
            expected, _ = stream.step(np.array([value]))
            assert native.get(1)[0] == pytest.approx(expected[0], abs=2e-6 * 8)
    for native in natives:
        native.free()


def test_instances_in_threads(rich: Loaded) -> None:
    """Eight instances stepped at the same time give what one gives alone."""
    inputs = np.random.default_rng(6).uniform(-1, 1, (2000, 2))

    def results(native: Native) -> list[list[float]]:
        rows = []
        for row in inputs:
            native.step(*row)
            rows.append(native.get(2, 4))
        return rows

    alone = results(rich.instance().start())
    with ThreadPoolExecutor(8) as pool:
        natives = [rich.instance().start() for _ in range(8)]
        assert all(rows == alone for rows in pool.map(results, natives))


def test_steps_other_than_h_are_refused(rich: Loaded) -> None:
    native = rich.instance().start()
    native.step(0.1, 0.2)
    saved = native.save()
    for step in (2 * STEP, STEP / 2, 0.0, -STEP, math.nan, math.inf, STEP * (1 + 1e-5)):
        assert native.do_step(STEP, step) == ERROR
        assert f"expected {STEP}" in native.messages[-1]
    assert native.save() == saved
    assert native.do_step(STEP, STEP * (1 + 1e-9)) == OK


def test_a_master_with_another_step_stops(rich: Loaded) -> None:
    """fmpy tries a discarded step again for ever; an error ends the simulation."""
    code = (
        "import sys, fmpy\n"
        f"fmpy.simulate_fmu(sys.argv[1], stop_time=1.0, output_interval={2 * STEP})"
    )
    result = subprocess.run(
        [sys.executable, "-c", code, str(rich.path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert result.returncode == 1
    message = f"communication step {2 * STEP} s; expected {STEP} s"
    assert (result.stdout + result.stderr).count(message) == 1
    assert "FMICallException: fmi2DoStep failed with status 3" in result.stderr


def test_communication_points_must_follow(rich: Loaded) -> None:
    native = rich.instance().start(10.0)
    for time in (0.0, 10.0 + STEP, 10.0 + 1e-5, math.nan):
        assert native.do_step(time) == ERROR
    assert native.do_step(10.0) == OK
    assert native.do_step(10.0) == ERROR
    assert native.do_step(10.0 + STEP) == OK


def test_times_are_counted_not_accumulated(load: Load) -> None:
    """A master that adds up its own time over a long run is still followed."""
    native = load(sum_surrogate()).instance().start()
    time = 0.0
    for _ in range(300_000):
        assert native.do_step(time) == OK
        time += STEP
    last = ctypes.c_double()
    assert native.call("fmi2GetRealStatus", 2, ctypes.byref(last)) == OK
    assert last.value == 300_000 * STEP


@pytest.mark.parametrize("start", [0.0, 1e8, -1e8])
def test_no_step_is_done_twice(load: Load, start: float) -> None:
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


def test_start_times_that_blur_the_steps_are_refused(rich: Loaded) -> None:
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
def test_unusable_inputs_are_discarded(rich: Loaded, value: float) -> None:
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


def test_bad_references_and_pointers(rich: Loaded) -> None:
    native = rich.instance().start()
    assert native.try_get(8)[0] == ERROR
    assert native.set(1.0, first=2) == ERROR
    assert "output" in native.messages[-1]
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


def test_calls_in_the_wrong_state(rich: Loaded) -> None:
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


def _functions() -> list[str]:
    header = Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h"
    return sorted(set(re.findall(r"\b(fmi2\w+)TYPE\b", header.read_text())))


def test_all_functions_of_the_standard_are_exported(rich: Loaded) -> None:
    windows = (BINARIES / "win64" / "slide.dll").read_bytes()
    functions = _functions()
    assert len(functions) > 40
    for function in functions:
        assert hasattr(rich.library, function)
        assert function.encode() + b"\0" in windows


def test_no_instance_is_an_error_never_a_crash(rich: Loaded) -> None:
    without = {"fmi2Instantiate", "fmi2FreeInstance", "fmi2GetVersion", "fmi2GetTypesPlatform"}
    for function in set(_functions()) - without:
        assert getattr(rich.library, function)(*[ctypes.c_void_p()] * 7) == ERROR
    rich.library.fmi2FreeInstance(ctypes.c_void_p())


def test_functions_that_are_not_offered(rich: Loaded) -> None:
    native = rich.instance().start()
    nothing = [ctypes.c_void_p()] * 6
    for function in (
        "fmi2GetDirectionalDerivative",
        "fmi2SetRealInputDerivatives",
        "fmi2GetRealOutputDerivatives",
        "fmi2CancelStep",
        "fmi2GetStatus",
        "fmi2GetContinuousStates",
        "fmi2EnterEventMode",
    ):
        assert native.call(function, *nothing) == ERROR
        assert native.messages[-1].startswith(function)


def test_debug_logging(rich: Loaded) -> None:
    native = rich.instance()
    no_categories = (ctypes.c_size_t(0), None)
    native.start()
    assert native.messages == []
    assert native.call("fmi2SetDebugLogging", 1, *no_categories) == OK
    native.call("fmi2Terminate")
    assert native.messages == ["fmi2Terminate"]
    wrong = (ctypes.c_char_p * 1)(b"everything")
    assert native.call("fmi2SetDebugLogging", 1, ctypes.c_size_t(1), wrong) == ERROR


def test_no_callbacks_at_all(rich: Loaded) -> None:
    library = rich.library
    library.fmi2Instantiate.restype = ctypes.c_void_p
    arguments = (b"one", 1, rich.guid.encode(), rich.uri.encode(), None, 0, 1)
    component = ctypes.c_void_p(library.fmi2Instantiate(*arguments))
    assert component.value
    assert library.fmi2DoStep(component, ctypes.c_double(0), ctypes.c_double(1), 0) == ERROR
    library.fmi2FreeInstance(component)


def test_resource_locations(rich: Loaded, tmp_path: Path) -> None:
    odd = tmp_path / "with space, % and ü"
    shutil.copytree(rich.folder / "resources", odd)
    path = str(rich.folder / "resources")
    for uri in (f"file:{path}", f"file://localhost{path}", f"FILE://{path}/", odd.as_uri()):
        assert rich.instance(uri=uri).component.value, uri
    for uri in (path, "", f"http://{path}", f"file://elsewhere{path}", "file:///%zz", "file:///%"):
        native = Native(rich.library, rich.guid, uri)
        assert not native.component.value
        assert len(native.messages) == 1


def test_instantiation_is_refused(rich: Loaded) -> None:
    assert not rich.instance(guid="other").component.value
    assert "GUID other; expected slide-" in rich.instances[-1].messages[0]
    payload = rich.folder / "resources" / "surrogate.slide"
    payload.write_bytes(payload.read_bytes()[:-5])
    native = rich.instance()
    assert not native.component.value
    assert "checksum" in native.messages[0]
    payload.unlink()
    assert "cannot read" in rich.instance().messages[0]
