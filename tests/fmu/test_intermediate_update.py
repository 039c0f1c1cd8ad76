"""Steps of several samples that an importer of FMI 3.0 watches: variables at each sample."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest

from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import LASTING, both_holds, drawn
from tests.fmu.native import ERROR, OK, ExportedFmu, Load
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.places import first_of
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, positions=3, differences=1),
    "cell": Shape(n_inputs=2, n_outputs=2, positions=3, cell=LASTING),
    "director": Shape(n_inputs=2, n_outputs=2, features="director"),
}
without_angles = pytest.mark.parametrize(
    "shape", [SHAPES["layers"], SHAPES["cell"]], ids=["layers", "cell"]
)
every_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


@both_holds
@every_shape
def test_intermediate_updates_that_only_read_change_nothing(
    load: Load, shape: Shape, hold: str
) -> None:
    """All variables after steps of up to n_in samples, to the bit."""
    surrogate = random_surrogate(Shape(**{**vars(shape), "hold": hold}))
    loaded, times = load(surrogate), []
    plain = instance_of(loaded).start()
    watched = instance_of(
        loaded, watch=lambda time, may_set: times.append((time, may_set))
    ).start()
    count, time = first_of(surrogate, "INITIAL_INPUT"), 0.0
    expected_times = []
    lengths = np.random.default_rng(0).choice([1, 2, 3, 12], 40).tolist()
    for row, length in zip(drawn(40, 2), lengths, strict=True):
        assert plain.set(*row) == watched.set(*row) == OK
        assert plain.do_step(time, length * STEP) == watched.do_step(time, length * STEP) == OK
        assert plain.get(0, count) == watched.get(0, count)
        expected_times += [(time + k * STEP, k < length) for k in range(1, length + 1)]
        time += length * STEP
    assert times == [(pytest.approx(t), may_set) for t, may_set in expected_times]


@both_holds
@every_shape
def test_inputs_set_in_intermediate_updates_give_the_results_of_single_steps(
    load: Load, shape: Shape, hold: str
) -> None:
    """An importer that sets inputs on the way has the results of single steps."""
    surrogate = random_surrogate(Shape(**{**vars(shape), "hold": hold}))
    loaded, rows = load(surrogate), drawn(41, 2)
    seen: list[list[float]] = []

    def watch(_time: float, may_set: bool) -> None:
        seen.append(watched.get(0, 4))
        if may_set:
            assert watched.set(*rows[len(seen)]) == OK, watched.messages

    watched, single = instance_of(loaded, watch=watch), instance_of(loaded).start()
    watched.start()
    assert watched.set(*rows[0]) == OK
    assert watched.do_step(0.0, 40 * STEP) == OK
    expected = []
    for k in range(40):
        assert single.set(*rows[k]) == single.do_step(k * STEP) == OK
        expected.append(single.get(0, 4))
    assert np.array_equal(np.array(seen), np.array(expected))


@pytest.mark.parametrize("at_step_end", [0, 1])
@both_holds
@every_shape
def test_setting_no_variable_in_intermediate_updates_changes_nothing(
    load: Load, shape: Shape, hold: str, at_step_end: int
) -> None:
    changes = {"hold": hold, "forecasts": hold == "first_order" and not at_step_end}
    surrogate = random_surrogate(Shape(**{**vars(shape), **changes}))
    loaded = load(surrogate)
    plain = instance_of(loaded)
    watched = instance_of(loaded, watch=lambda _time, _may_set: watched.set() and None)
    for native in (plain, watched):
        started(native, surrogate, at_step_end)
    for k, row in enumerate(drawn(10, 2)):
        assert plain.set(*row) == watched.set(*row) == OK
        for native in (plain, watched):
            assert native.do_step(4 * k * STEP, 4 * STEP) == OK
        assert plain.get(0, 4) == watched.get(0, 4)


def started(native: Native3, surrogate: Surrogate, at_step_end: float) -> Native3:
    """An FMU after initialization; where inputs move, they are those of the start of a step or of
    its end."""
    names = [variable.name for variable in fmu_variables(surrogate, 3)]
    if "inputs_at_step_end" in names:
        assert native.set(at_step_end, first=names.index("inputs_at_step_end")) == OK
    return native.start()


@without_angles
def test_inputs_that_were_not_set_in_intermediate_updates_go_on_to_the_end_of_the_step(
    load: Load, shape: Shape
) -> None:
    """One input is set to what it would be; the other reaches what was set before the step."""
    surrogate = random_surrogate(Shape(**{**vars(shape), "hold": "first_order"}))
    loaded, rows = load(surrogate), drawn(11, 2)
    ahead: list[float] = []

    def watch(_time: float, may_set: bool) -> None:
        if may_set:
            assert watched.set(ahead.pop(0)) == OK

    plain, watched = instance_of(loaded), instance_of(loaded, watch=watch)
    for native in (plain, watched):
        started(native, surrogate, 1)
    before = rows[0]
    for k, row in enumerate(rows):
        way = np.linspace(before[0], row[0], 5)
        ahead.extend(way[2:])
        assert plain.set(*row) == watched.set(*row) == OK
        for native in (plain, watched):
            assert native.do_step(4 * k * STEP, 4 * STEP) == OK
        assert watched.get(0, 2) == row.tolist()
        np.testing.assert_allclose(watched.get(2, 2), plain.get(2, 2), rtol=1e-4, atol=1e-5)
        before = row


@without_angles
def test_inputs_that_were_not_set_in_intermediate_updates_are_forecast_on(
    load: Load, shape: Shape
) -> None:
    """Of two inputs one moves and is set at each sample; the other stays, and is forecast to."""
    surrogate = random_surrogate(
        Shape(**{**vars(shape), "hold": "first_order", "forecasts": True})
    )
    loaded, values = load(surrogate), drawn(40, 1)[:, 0].tolist()
    seen: list[list[float]] = []

    def watch(_time: float, may_set: bool) -> None:
        seen.append(watched.get(0, 4))
        if may_set:
            assert watched.set(values[len(seen)]) == OK

    watched, single = instance_of(loaded, watch=watch), instance_of(loaded).start()
    watched.start()
    for k in range(10):
        assert watched.set(values[4 * k], 0.5) == watched.do_step(4 * k * STEP, 4 * STEP) == OK
    expected = []
    for k, value in enumerate(values):
        assert single.set(value, 0.5) == single.do_step(k * STEP) == OK
        expected.append(single.get(0, 4))
    assert np.array_equal(np.array(seen), np.array(expected))


def test_intermediate_update_has_the_time_of_its_sample_and_says_what_may_be_called(
    rich: ExportedFmu,
) -> None:
    time_reference = first_of(rich.surrogate, "TIME")
    found: list[object] = []

    def watch(time: float, _may_set: bool) -> None:
        assert watched.get(time_reference) == [time]
        for call in (watched.do_step(time), watched.call("fmi3Reset"), watched.initialize()):
            assert call == ERROR
            assert "must not be called in state 'intermediate update mode'" in watched.messages[-1]
        state = ctypes.c_void_p()
        assert watched.call("fmi3GetFMUState", ctypes.byref(state)) == ERROR
        assert watched.set(1.0, first=time_reference - 3) == ERROR
        assert "is a parameter" in watched.messages[-1]
        found.append(time)

    watched = instance_of(rich, watch=watch).start(1.0)
    assert watched.do_step(1.0, 3 * STEP) == OK
    assert watched.do_step(1.0 + 3 * STEP, 0.5 * STEP) == OK
    assert found == pytest.approx([1 + STEP, 1 + 2 * STEP, 1 + 3 * STEP, 1 + 3.5 * STEP])
    assert watched.last == pytest.approx(1 + 3.5 * STEP)


@pytest.mark.parametrize(("until", "end"), [(2, 2), (2.5, 3), (0, 1), (9, 4), (math.nan, 4)])
def test_step_that_may_return_early_ends_at_the_sample_that_was_asked_for(
    rich: ExportedFmu, until: float, end: int
) -> None:
    asked = instance_of(rich, watch=lambda _time, _may_set: until * STEP, ends=True).start()
    assert asked.do_step(0.0, 4 * STEP) == OK
    assert asked.last == pytest.approx(end * STEP)
    assert asked.flags == (False, False, end < 4)
    plain = instance_of(rich).start()
    assert plain.do_step(0.0, end * STEP) == OK
    assert plain.get(2, 4) == asked.get(2, 4)
    assert asked.do_step(end * STEP) == OK


@pytest.mark.parametrize("start", [0.0, 0.3, -7.1])
def test_early_return_at_the_rounded_time_of_a_sample_ends_there(
    rich: ExportedFmu, start: float
) -> None:
    """Times that an importer rounds in its own way."""
    for k in range(1, 99, 7):
        wanted = round(start + k * STEP, 10)
        asked = instance_of(rich, watch=lambda _time, _may_set, at=wanted: at, ends=True).start(
            start
        )
        assert asked.do_step(start, 100 * STEP) == OK
        assert asked.last == pytest.approx(wanted, abs=1e-9)


def test_early_return_ends_one_step_alone(rich: ExportedFmu) -> None:
    asked = instance_of(
        rich, watch=lambda time, _may_set: 2.5 * STEP if time < 1.5 * STEP else None, ends=True
    ).start()
    assert asked.do_step(0.0, 6 * STEP) == OK
    assert (asked.last, asked.flags) == (pytest.approx(3 * STEP), (False, False, True))
    assert asked.do_step(3 * STEP, 6 * STEP) == OK
    assert asked.flags == (False, False, False)


def test_step_that_may_not_return_early_goes_to_its_end(rich: ExportedFmu) -> None:
    asked = instance_of(rich, watch=lambda time, _may_set: time).start()
    assert asked.do_step(0.0, 4 * STEP) == OK
    assert (asked.last, asked.flags) == (pytest.approx(4 * STEP), (False, False, False))


@both_holds
def test_step_that_fails_at_an_intermediate_update_changes_nothing(load: Load, hold: str) -> None:
    shape = Shape(cell=CellShape(activation="cubic"), hold=hold)  # type: ignore[arg-type]
    loaded, bad = load(random_surrogate(shape)), False

    def watch(time: float, _may_set: bool) -> None:
        if bad and time > 8.5 * STEP:
            assert watched.set(1e30) == OK

    watched = instance_of(loaded, watch=watch).start()
    for k in range(3):
        assert watched.set(0.4 * k) == watched.do_step(2 * k * STEP, 2 * STEP) == OK
    saved, bad = watched.save(), True
    assert watched.do_step(6 * STEP, 6 * STEP) == ERROR
    assert "are not finite" in watched.messages[-1]
    assert watched.save() == saved
    assert watched.last == pytest.approx(6 * STEP)
    bad = False
    assert watched.do_step(6 * STEP, 6 * STEP) == OK


@both_holds
def test_input_derivatives_hold_for_the_whole_step_with_intermediate_updates(
    load: Load, hold: str
) -> None:
    """Which a state of FMI 2.0 brings."""
    loaded = load(random_surrogate(Shape(hold=hold, positions=3)))  # type: ignore[arg-type]
    moving, times = loaded.instance().start(), []
    watched = instance_of(loaded, watch=lambda time, may_set: times.append((time, may_set)))
    assert moving.set(0.3) == moving.set_rates(40.0) == watched.restore(moving.save()) == OK
    assert moving.do_step(0.0, 3 * STEP) == watched.do_step(0.0, 3 * STEP) == OK
    assert moving.get(1, 2) == watched.get(1, 2)
    assert times == [(pytest.approx(3 * STEP), False)]


def test_director_of_zero_set_in_an_intermediate_update_is_refused(load: Load) -> None:
    loaded = load(random_surrogate(SHAPES["director"]))
    watched = instance_of(loaded, watch=lambda _time, _may_set: watched.set(0.0, 0.0) and None)
    watched.start()
    assert watched.set(1.0, 0.0) == OK
    assert watched.do_step(0.0, 3 * STEP) == ERROR
    assert "gives no direction" in watched.messages[-1]
    assert watched.get(0, 2) == [1.0, 0.0]


def test_time_does_not_slip_over_many_early_returns(load: Load) -> None:
    watched = instance_of(load(sum_surrogate()), watch=lambda _time, _may_set: None).start()
    for k in range(20_000):
        assert watched.do_step(3 * k * STEP, 3 * STEP) == OK
    assert watched.last == pytest.approx(60_000 * STEP, rel=1e-12)
