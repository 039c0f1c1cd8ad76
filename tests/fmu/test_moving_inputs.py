"""Inputs that move: the value set is u(t), the rest is forecast until the true sample comes."""

from __future__ import annotations

import ctypes
import dataclasses
import itertools
import time
import zlib

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import ESTIMATE_TOLERANCE, LASTING, NAMES, PATTERNS, SHAPES, go, n_phases
from tests.fmu.derivatives import ROUNDED, derivative, surrogate_of
from tests.fmu.future import future
from tests.fmu.moving_inputs import MovingOracle, forecasting, moving_inputs
from tests.fmu.native import DISCARD, ERROR, OK, Load, Native
from tests.fmu.native3 import instance_of
from tests.fmu.plain import ResamplingOracle, five_point_slope
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate
from tests.marks import essential, every

AT_STEP_END = 12_000_000
BETWEEN = 0.05
"""Of outputs between phases, where inputs are rough."""

STEPS = 36
"""Steps of a run: a few windows."""


def moving(shape: Shape) -> Surrogate:
    return forecasting(random_surrogate(dataclasses.replace(shape, hold="first_order")))


def with_constant_outputs(surrogate: Surrogate) -> Surrogate:
    """The same but for its outputs, which no input changes."""
    network = surrogate.network
    assert isinstance(network, FeedForward)
    last = network.layers[-1]
    constant = dataclasses.replace(last, weights=np.zeros_like(last.weights))
    layers = (*network.layers[:-1], constant)
    network = FeedForward(layers, network.n_samples, network.features)
    return dataclasses.replace(surrogate, network=network)


def outputs_of(
    native: Native, surrogate: Surrogate, lengths: list[float], rows: FloatArray
) -> FloatArray:
    """Outputs and error estimates after each step."""
    return go(native, lengths, rows, 2 * len(surrogate.outputs))


def what_follows(native: Native, surrogate: Surrogate) -> list[object]:
    """All that is seen of the present state, to the bit."""
    row = tuple(float(value) for value in surrogate.starts)
    count = len(fmu_variables(surrogate)) - 2 - len(row)
    return future(native, native.time(), row, count)


@pytest.mark.parametrize("pattern", essential({"whole": [1], "double": [2], **PATTERNS}, "whole"))
@pytest.mark.parametrize("shape", every(2, SHAPES), ids=NAMES)
def test_step_gives_the_window_of_the_true_past_and_of_the_forecast(
    load: Load, shape: Shape, pattern: str
) -> None:
    surrogate = moving(shape)
    lengths = ({"whole": [1.0], "double": [2.0], **PATTERNS}[pattern] * STEPS)[:STEPS]
    rows, oracle = moving_inputs(surrogate, STEPS), MovingOracle(surrogate)
    found = outputs_of(load(surrogate).instance().start(), surrogate, lengths, rows)
    n = len(surrogate.outputs)
    for k, (length, row) in enumerate(zip(lengths, rows, strict=True)):
        outputs, estimates = oracle.step(length * STEP, row).results()
        if shape.cell is not None and n_phases(length) == 0:  # interpolated between phases
            np.testing.assert_allclose(found[k, :n], outputs, rtol=0, atol=BETWEEN, err_msg=f"{k}")
            continue
        np.testing.assert_allclose(
            found[k, :n], outputs, rtol=0, atol=2 * OUTPUT_TOLERANCE * 8, err_msg=f"{k}"
        )
        # what forecasts changed lately adds to them: test_error_bounds.py says how
        assert estimates is not None
        assert np.all(found[k, n:] > (1 - ESTIMATE_TOLERANCE) * estimates)


@pytest.mark.parametrize("means", [False, True])
@pytest.mark.parametrize("length", [1.0, 2.0, 0.6])
def test_estimate_is_that_of_the_true_past_and_of_the_forecast(
    load: Load, length: float, means: bool
) -> None:
    """Of samples outside what the estimator knows, too. The outputs are constant, so that no
    forecast changes them and adds to the estimates."""
    shape = Shape(n_inputs=2, n_outputs=2, positions=3, means=means)
    surrogate = with_constant_outputs(moving(shape))
    assert surrogate.estimator is not None
    known = np.array([[-0.5, -0.5], [0.5, 0.5]], np.float32)  # of the scaled inputs
    estimator = dataclasses.replace(surrogate.estimator, ranges=known)
    surrogate = dataclasses.replace(surrogate, estimator=estimator)
    largest = 10**estimator.log_error.high
    rows, oracle = moving_inputs(surrogate, 2 * STEPS), MovingOracle(surrogate)
    found = outputs_of(load(surrogate).instance().start(), surrogate, [length] * len(rows), rows)
    expected = np.array([oracle.step(length * STEP, row).results()[1] for row in rows])
    np.testing.assert_allclose(found[:, 2:], expected, rtol=ESTIMATE_TOLERANCE)
    n_unknown = np.rint((expected / surrogate.output_scaling.scale / largest) ** 2 * 3)
    assert set(n_unknown.ravel()) == {0, 1, 2, 3}  # of the three samples of an estimate


def test_step_gives_what_a_record_gives_that_ends_with_the_forecast(load: Load) -> None:
    """A cell that remembers longer than its window: states take turns as in a record."""
    surrogate = moving(Shape(n_inputs=2, n_outputs=2, cell=LASTING, differences=1))
    rows, oracle = moving_inputs(surrogate, 40), MovingOracle(surrogate)
    found = outputs_of(load(surrogate).instance().start(), surrogate, [1.0] * 40, rows)
    for k, row in enumerate(rows):
        goal = oracle.step(STEP, row).goal
        expected = surrogate.predict_newest(np.vstack([rows[: k + 1], goal]))[-1]
        np.testing.assert_allclose(found[k, :2], expected, rtol=0, atol=16 * OUTPUT_TOLERANCE)


@pytest.mark.parametrize("start", [0, 1])
def test_inputs_at_the_step_end_need_no_forecast(load: Load, start: int) -> None:
    """Whether the surrogate or the importer says so, a forecast changes no bit at samples."""
    shape = Shape(n_inputs=2, n_outputs=2, positions=3, cell=LASTING, hold="first_order")
    without = random_surrogate(shape)
    own = forecasting(without, at_step_end=bool(start), planned=not start)
    rows, lengths = moving_inputs(without, 30), [1.0] * 30
    native, other = (load(dataclasses.replace(s, name=n)).instance() for s, n in
                     ((own, "own"), (without, "without")))  # fmt: skip
    set_at_step_end(other, 1.0)
    if not start:
        set_at_step_end(native, 1.0)
    assert get_at_step_end(native.start()) == 1.0
    expected = outputs_of(other.start(), without, lengths, rows)
    np.testing.assert_array_equal(outputs_of(native, own, lengths, rows), expected)


def set_at_step_end(native: Native, value: float, status: int = OK) -> None:
    reference, number = (ctypes.c_uint * 1)(AT_STEP_END), (ctypes.c_double * 1)(value)
    assert native.call("fmi2SetReal", reference, ctypes.c_size_t(1), number) == status


def get_at_step_end(native: Native) -> float:
    reference, number = (ctypes.c_uint * 1)(AT_STEP_END), (ctypes.c_double * 1)()
    assert native.call("fmi2GetReal", reference, ctypes.c_size_t(1), number) == OK
    return number[0]


def test_without_a_forecast_the_importer_may_still_have_values_held_until_they_are_set(
    load: Load,
) -> None:
    loaded = load(sum_surrogate(hold="first_order"))
    native = loaded.instance()
    set_at_step_end(native, 0.0)
    assert get_at_step_end(native.start()) == 0.0
    assert get_at_step_end(loaded.instance().start()) == 0.0
    found = []
    for k, value in enumerate([0.0, 1.0, 0.5]):
        assert native.set(value) == native.do_step(k * STEP) == OK
        found += native.get(1)
    assert found == [0.0, 2.0, 2.0]  # 0 + 0 + 1 + 1, 0 + 1 + 0.5 + 0.5


@pytest.mark.parametrize("value", [0.5, 2.0, -1.0, np.nan])
def test_what_is_set_of_the_meaning_must_be_0_or_1_and_before_the_start(
    load: Load, value: float
) -> None:
    native = load(moving(Shape())).instance()
    set_at_step_end(native, value, DISCARD)
    assert "expected 0 or 1" in native.messages[-1]
    set_at_step_end(native.start(), 1.0, ERROR)
    assert "is a parameter" in native.messages[-1]
    assert get_at_step_end(native) == 0.0


def test_zero_order_holds_have_no_such_parameter(load: Load) -> None:
    native = load(random_surrogate(Shape())).instance()
    set_at_step_end(native, 1.0, ERROR)
    assert "no variable has the value reference" in native.messages[-1]


LENGTHS = [1, 1, 3, 0.02, 0.01, 1, 0.6, 1, 5, 1, 2.3, 1, 0.5, 8, 1, 7.7, 1, 1, 8, 8, 20.5, 3, 13]
"""Steps in units of h; short ones are joined."""


@pytest.mark.parametrize("family", ["elu, skip", "tanh cell", "cubic cell", "gated cell"])
@pytest.mark.parametrize("seen", ["differences", "director", "chain"])
def test_derivatives_are_those_by_the_inputs_that_were_set_last(
    load: Load, seen: str, family: str
) -> None:
    """Finite differences by rollback: the forecast moves with what it begins from. They are small:
    with others, another forecast would be the best one at times."""
    surrogate = forecasting(surrogate_of(seen, family, hold="first_order", n_in=13))
    native, count = load(surrogate).instance().start(), len(surrogate.inputs)
    distance, direction = 1e-3, np.linspace(0.7, -1, count)
    for row, length in zip(moving_inputs(surrogate, len(LENGTHS)), LENGTHS, strict=True):
        before = native.save()

        def output(amount: float, row: FloatArray = row, length: float = length) -> FloatArray:
            assert native.restore(before) == OK  # noqa: B023 (called within this turn)
            assert native.set(*(row + amount * direction)) == OK
            assert native.do_step(native.time(), length * STEP) == OK, native.messages
            return np.array(native.get(count, 2))

        expected, values = five_point_slope(output, distance), output(0.0)
        after = what_follows(native, surrogate)
        native.set(*(0.5 * row))
        found = derivative(native, 2, direction)
        allowed = ROUNDED * (1 + np.abs(values).max()) / distance
        np.testing.assert_allclose(found, expected, rtol=2e-3, atol=4 * allowed)
        assert native.get(count, 2) == list(values)
        native.set(*row)
        assert what_follows(native, surrogate) == after


@pytest.mark.parametrize("length", [1.0, 3.0, 0.6])
@pytest.mark.parametrize("family", ["elu, skip", "tanh cell"])
def test_state_saved_within_a_forecast_goes_on_in_another_instance(
    load: Load, family: str, length: float
) -> None:
    surrogate = forecasting(surrogate_of("differences", family, hold="first_order"))
    loaded, rows = load(surrogate), moving_inputs(surrogate, 30)
    one, other = loaded.instance().start(), loaded.instance()
    outputs_of(one, surrogate, [length] * 10, rows[:10])
    assert other.restore(one.save()) == OK
    expected = outputs_of(one, surrogate, [length] * 20, rows[10:])
    np.testing.assert_array_equal(outputs_of(other, surrogate, [length] * 20, rows[10:]), expected)


@pytest.mark.parametrize("lengths", [[1.0], [3.0, 1.0], [0.6], [0.6, 1.0], [1.0, 0.6]])
@pytest.mark.parametrize("n_before", [0, 1, 7])
@pytest.mark.parametrize("cell", [None, CellShape(activation="cubic")], ids=["layers", "cell"])
def test_failed_step_leaves_no_trace_of_it(
    load: Load, cell: CellShape | None, n_before: int, lengths: list[float]
) -> None:
    """Layers fail by what is forecast, cells, which see every sample, by what was set."""
    surrogate = forecasting(sum_surrogate(hold="first_order"))
    if cell is not None:
        surrogate = moving(Shape(cell=cell, differences=2, positions=2))
    native, row = load(surrogate).instance().start(), moving_inputs(surrogate, 20)
    outputs_of(native, surrogate, (lengths * n_before)[:n_before], row[:n_before])
    assert native.set(3e38) == OK
    expected = what_follows(native, surrogate)
    assert native.do_step(native.time(), (lengths * 8)[n_before] * STEP) == ERROR
    assert "are not finite" in native.messages[-1]
    assert native.set(3e38) == OK
    assert what_follows(native, surrogate) == expected


HEADER, CHECKSUM = 72, 12
"""Bytes of the header of a serialised state, and the place of the checksum in it."""


def test_step_from_a_state_with_a_wrong_counter_ends(load: Load) -> None:
    """The checksum fits: the state was damaged before it was saved."""
    surrogate = moving(Shape(cell=LASTING, differences=1))
    native, rows = load(surrogate).instance().start(), moving_inputs(surrogate, 9)
    saved = []
    for row in rows:
        outputs_of(native, surrogate, [1.0], row[None])
        data = native.save()
        saved.append(np.frombuffer(data, "<u8", count=len(data) // 8))
    counters = np.flatnonzero(saved[-1] - saved[-2] == 1)
    assert len(counters) > 3
    for counter in counters:
        words = saved[-1].copy()
        words[counter] = 10**9
        damaged = bytearray(words.tobytes() + data[8 * len(words) :])
        damaged[CHECKSUM : CHECKSUM + 4] = zlib.crc32(damaged[HEADER:]).to_bytes(4, "little")
        if native.restore(bytes(damaged)) != OK:
            assert "no state has such counters" in native.messages[-1]
        assert native.set(*rows[0]) == OK
        begin = time.process_time()
        native.do_step(native.time())
        assert time.process_time() - begin < 0.5, f"counter in word {counter}"


@pytest.mark.parametrize("shape", [SHAPES[0], SHAPES[2], SHAPES[5]], ids=["layers", "cell", "arc"])
def test_initial_inputs_come_a_sample_step_before_the_first_value(
    load: Load, shape: Shape
) -> None:
    """As if the FMU had run on them until a sample step before the start."""
    surrogate = moving(shape)
    n, loaded = len(surrogate.inputs), load(surrogate)
    rows = moving_inputs(surrogate, 12)
    knowing, earlier = loaded.instance(), loaded.instance().start()
    place = [v.name for v in fmu_variables(surrogate)].index("prehistory_known")
    assert knowing.set(1.0, *rows[0], first=place) == OK
    knowing.start()
    outputs_of(earlier, surrogate, [1.0], rows[:1])
    assert knowing.set(*rows[1]) == OK
    at_start = ResamplingOracle(surrogate)
    at_start.append(STEP, rows[0])
    at_start.append(STEP, rows[1])
    expected, _ = at_start.results()
    settled = np.array(knowing.get(n, len(surrogate.outputs)))
    np.testing.assert_allclose(settled, expected, rtol=0, atol=2 * OUTPUT_TOLERANCE * 8)
    slopes = derivative(knowing, len(surrogate.outputs), np.ones(n))
    expected_slopes = five_point_slope(
        lambda amount: outputs_at_start(knowing, surrogate, rows[1] + amount), 2e-3
    )
    np.testing.assert_allclose(slopes, expected_slopes, rtol=2e-2, atol=1e-3)
    assert knowing.set(*rows[1]) == OK
    expected = outputs_of(earlier, surrogate, [1.0] * 11, rows[1:])
    found, m = outputs_of(knowing, surrogate, [1.0] * 11, rows[1:]), len(surrogate.outputs)
    np.testing.assert_allclose(found[:, :m], expected[:, :m], rtol=0, atol=1e-5)


def outputs_at_start(native: Native, surrogate: Surrogate, row: FloatArray) -> FloatArray:
    assert native.set(*row) == OK
    return np.array(native.get(len(row), len(surrogate.outputs)))


@pytest.mark.parametrize("length", [1.0, 2.0, 0.6])
@pytest.mark.parametrize("shape", [SHAPES[0], SHAPES[2], SHAPES[5]], ids=["layers", "cell", "arc"])
def test_derivatives_of_inputs_go_before_the_forecast(
    load: Load, shape: Shape, length: float
) -> None:
    surrogate = moving(shape)
    native, oracle = load(surrogate).instance().start(), MovingOracle(surrogate)
    rows, n = moving_inputs(surrogate, 31), len(surrogate.outputs)
    for row, ahead in itertools.pairwise(rows):
        rates = (ahead - row) / (4 * length * STEP)
        assert native.set(*row) == native.set_rates(*rates) == OK
        assert native.do_step(native.time(), length * STEP) == OK, native.messages
        expected, _ = oracle.step(length * STEP, row, rates).results()
        found = native.get(len(row), n)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2 * OUTPUT_TOLERANCE * 8)


def test_forecasts_outside_the_range_are_kept_in_it(load: Load) -> None:
    """A value near the end of the range that moves towards it leaves it in no forecast."""
    surrogate = forecasting(sum_surrogate(hold="first_order"))
    native = load(surrogate).instance().start()
    in_range = [v.name for v in fmu_variables(surrogate)].index("inputs_in_range")
    for value in np.linspace(0.0, 0.99, 10):
        native.step(float(value))
        assert native.get(in_range) == [1.0]


@pytest.mark.parametrize("length", [2, 3, 12])
@pytest.mark.parametrize("shape", [SHAPES[0], SHAPES[2], SHAPES[5]], ids=["layers", "cell", "arc"])
def test_step_that_is_watched_ends_as_one_that_is_not(
    load: Load, shape: Shape, length: int
) -> None:
    surrogate = moving(shape)
    loaded, seen = load(surrogate), []
    watched = instance_of(loaded, watch=lambda time, _may_set: seen.append(time)).start()
    plain, rows = instance_of(loaded).start(), moving_inputs(surrogate, 20)
    for k, row in enumerate(rows):
        for native in (watched, plain):
            assert native.set(*row) == native.do_step(k * length * STEP, length * STEP) == OK
        n = len(surrogate.inputs)
        assert watched.get(n, 2 * len(surrogate.outputs)) == plain.get(
            n, 2 * len(surrogate.outputs)
        )
    assert len(seen) == 20 * length


def test_inputs_set_on_the_way_are_those_of_single_steps(load: Load) -> None:
    surrogate = moving(Shape(n_inputs=2, n_outputs=2, cell=LASTING))
    loaded, rows = load(surrogate), moving_inputs(surrogate, 41)
    seen: list[list[float]] = []

    def watch(_time: float, may_set: bool) -> None:
        seen.append(watched.get(2, 2))
        if may_set:
            assert watched.set(*rows[len(seen)]) == OK, watched.messages

    watched, single = instance_of(loaded, watch=watch), instance_of(loaded).start()
    watched.start()
    assert watched.set(*rows[0]) == watched.do_step(0.0, 40 * STEP) == OK
    expected = []
    for k in range(40):
        assert single.set(*rows[k]) == single.do_step(k * STEP) == OK
        expected.append(single.get(2, 2))
    np.testing.assert_array_equal(seen, expected)
