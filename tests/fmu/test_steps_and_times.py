"""Communication steps: their lengths, where they begin, and where the experiment stops."""

from __future__ import annotations

import ctypes
import dataclasses
import itertools
import math
import re

import fmpy
import numpy as np
import pytest

from tests.fmu.native import ERROR, OK, ExportedFmu, Load
from tests.fmu.samples import STEP, sum_surrogate


def test_step_of_no_positive_finite_length_is_refused(rich: ExportedFmu) -> None:
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


@pytest.mark.parametrize("written", [STEP * (1 + 2e-5), STEP * (1 - 2e-5)])
def test_step_that_is_written_with_five_digits_is_the_step(load: Load, written: float) -> None:
    """An importer writes 1/60 s as 0.016667 s; the whole window is not seen anew at each step."""
    loaded = load(sum_surrogate())
    rounded, exact = loaded.instance().start(), loaded.instance().start()
    for k in range(40):
        assert rounded.set(math.sin(0.7 * k)) == exact.set(math.sin(0.7 * k)) == OK
        assert rounded.do_step(k * written, written) == OK, rounded.messages
        assert exact.do_step(k * STEP, STEP) == OK
        assert rounded.get(1, 3) == exact.get(1, 3)
    longer = loaded.instance().start()
    assert longer.do_step(0.0, STEP * (1 + 1e-4)) == OK
    assert longer.get(1, 3) != exact.get(1, 3)


def test_no_step_ends_after_the_stop_time(rich: ExportedFmu) -> None:
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


def test_stop_time_holds_for_its_own_run_alone(rich: ExportedFmu) -> None:
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
    rich: ExportedFmu, interval: float
) -> None:
    result = fmpy.simulate_fmu(str(rich.path), stop_time=1.0, output_interval=interval)
    assert result["time"][-1] == pytest.approx(1.0)
    assert result["window_filled"][-1] == 1.0


def test_step_that_does_not_follow_the_last_one_is_refused(rich: ExportedFmu) -> None:
    native = rich.instance().start(10.0)
    for time in (0.0, 10.0 + STEP, 10.0 + 1e-5, math.nan):
        assert native.do_step(time) == ERROR
    assert native.do_step(10.0) == OK
    assert native.do_step(10.0) == ERROR
    assert native.do_step(10.0 + STEP) == OK


@pytest.mark.extended
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


def test_start_time_too_large_to_resolve_the_step_is_refused(rich: ExportedFmu) -> None:
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
