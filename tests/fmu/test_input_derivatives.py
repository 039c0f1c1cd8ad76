"""Steps whose inputs move, by the derivatives that an importer gives, against plain numpy."""

from __future__ import annotations

import ctypes
import dataclasses
import math

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.network.state_space.network import StateSpace
from tests.bounded import bounded_surrogate
from tests.fmu.any_step import (
    ESTIMATE_TOLERANCE,
    FORGETFUL,
    LASTING,
    NAMES,
    PATTERNS,
    SHAPES,
    both_holds,
    drawn,
    n_phases,
)
from tests.fmu.derivatives import ROUNDED, derivative, inputs_for, surrogate_of
from tests.fmu.moving_inputs import MovingOracle
from tests.fmu.native import DISCARD, ERROR, OK, WARNING, ExportedFmu, Load, Native
from tests.fmu.plain import five_point_slope
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate
from tests.marks import essential


def rates_for(lengths: list[float], n_inputs: int) -> FloatArray:
    """Inputs move by up to about 1 in h, and over longer steps in all; some steps by nothing."""
    rng = np.random.default_rng(5)
    rates = rng.normal(0, 0.3, (len(lengths), n_inputs)) / STEP
    rates /= np.maximum(lengths, 1)[:, None]
    rates[rng.random(len(lengths)) < 0.2] = 0.0
    return np.asarray(rates)


def assert_outputs(found: FloatArray, outputs: FloatArray, oracle: MovingOracle) -> None:
    """Outputs are those of the window, to single precision, which is relative to their size.

    What a cell forgets within the window grows with its inputs. In a long step after short ones
    the curve through the told points swings out to a hundred times the range, and then this is
    more than rounding: the outputs are those of one of the hand-overs that there may have been.
    """
    size = max(8.0, float(np.abs(outputs).max()))
    allowed, network = 2 * OUTPUT_TOLERANCE * size, oracle.surrogate.network
    if isinstance(network, StateSpace) and np.abs(found - outputs).max() > allowed:
        rows = oracle.of_hand_overs()
        outputs = rows[np.abs(rows - found).max(axis=1).argmin()]
    np.testing.assert_allclose(found, outputs, rtol=0, atol=allowed)


@pytest.mark.extended
@both_holds
@pytest.mark.parametrize("pattern", essential(PATTERNS, "switching"))
@pytest.mark.parametrize("shape", SHAPES, ids=NAMES)
def test_moving_inputs_are_resampled(load: Load, shape: Shape, pattern: str, hold: Hold) -> None:
    surrogate = random_surrogate(dataclasses.replace(shape, hold=hold))
    lengths, n = (PATTERNS[pattern] * 60)[:60], shape.n_outputs
    inputs, rates = drawn(60, shape.n_inputs), rates_for(lengths, shape.n_inputs)
    native, time = load(surrogate).instance(held=False).start(), 0.0
    oracle = MovingOracle(surrogate, known=hold == "first_order")
    for length, row, slope in zip(lengths, inputs, rates, strict=True):
        assert native.set(*row) == native.set_rates(*slope) == OK
        assert native.do_step(time, length * STEP) == OK, native.messages
        time += length * STEP
        outputs, estimates = oracle.step(length * STEP, row, slope).results()
        assert estimates is not None
        found = np.array(native.get(shape.n_inputs, 2 * n))
        if shape.cell is not None and n_phases(length) == 0:  # interpolated between phases
            assert np.all(np.isfinite(found))
            continue
        assert_outputs(found[:n], outputs, oracle)
        if hold == "first_order":  # nothing is forecast; below 1e-150 the FMU gives this
            np.testing.assert_allclose(found[n:], estimates, rtol=ESTIMATE_TOLERANCE, atol=1e-100)
        assert np.all(found[n:] > (1 - ESTIMATE_TOLERANCE) * estimates)


@pytest.mark.parametrize("length", [0.25, 0.5, 0.6, 1, 3])
@pytest.mark.parametrize("bounded", [False, True], ids=["estimate", "bound"])
def test_first_sample_that_was_told_to_move_is_judged_by_what_it_became(
    load: Load, bounded: bool, length: float
) -> None:
    """The sample that stands for all before it ends in the first step, and is not final until the
    next one: estimates and bounds are the same whether or not they were read before that."""
    shape = Shape(n_inputs=2, n_outputs=2, positions=0 if bounded else 3, cell=LASTING)
    surrogate = bounded_surrogate(shape, (2, 5)) if bounded else random_surrogate(shape)
    keys = ("ERROR_BOUND", "NOVELTY") if bounded else ("ERROR_ESTIMATE",)
    places = [i for i, v in enumerate(fmu_variables(surrogate)) if v.kind.key in keys]
    loaded = load(surrogate)
    often, late = (loaded.instance(held=False).start() for _ in range(2))
    for k, row in enumerate(drawn(24, 2)):
        for one in (often, late):
            assert one.set(*row) == one.set_rates(0.3 / STEP, -0.2 / STEP) == OK
            assert one.do_step(one.time(), length * STEP) == OK, one.messages
        found = [often.get(place) for place in places]
        if k >= 8:
            assert found == [late.get(place) for place in places]


def test_sum_of_a_window_under_moving_inputs_is_that_of_means_by_hand(load: Load) -> None:
    """The sum of four samples: each is the mean of a held input that moves. A ramp has the moment
    1 / 12. Of it, the four samples get (-9, 5, -25, 59, 9) / 48 where it is that of the newest, of
    the next ones, or of the fifth; and (-12, -4, 20, -28, 12) / 48 of the third moment 1 / 80. The
    kink has the moments 1 / 24, 1 / 192 and 1 / 160, of which the sample after it gets 9 / 48,
    21 / 48 and 12 / 48."""
    native = load(sum_surrogate()).instance().start()
    for length, expected in (
        (1, 0.5 - 9 / 576 - 12 / 3840),
        (2, 4.5 - 29 / 576 + 4 / 3840),
        (1, 8 + 30 / 576 - 24 / 3840),
        (0.5, 10 + 30 / 576 - 24 / 3840 + 9 / 48 / 24 + 21 / 48 / 192 + 12 / 48 / 160),
        (0.5, 12 + 39 / 576 - 12 / 3840),
    ):
        time = native.time()
        assert native.set(time / STEP) == native.set_rates(1 / STEP) == OK
        assert native.do_step(time, length * STEP) == OK
        assert native.get(1) == [pytest.approx(expected)]


@pytest.mark.parametrize("held", [False, True])
def test_told_inputs_go_to_what_is_set_next(load: Load, held: bool) -> None:
    """Until then they go where the derivative leads, also where all others are held. On a line, or
    after a kink, they have a moment of which the four samples get -9 / 48 and then 5 / 48, and a
    third one, of which they get -12 / 48 and -4 / 48. A sample that moves smoothly has none: the
    one before it has an edge of its slope: it, 5 / 48 of a half, 3 / 48 of a quarter and -4 / 48
    of an eighth."""
    native = load(sum_surrogate()).instance(held=held).start()
    newest, before = 9 / 576 + 12 / 3840, 5 / 576 - 4 / 3840
    edge = (48 + 5 / 2 + 3 / 4 - 4 / 8) / 576
    for value, rate, expected in (
        (0.5, 0.0, 2.0),
        (0.0, 0.1, 1.55 - 0.1 * (newest if held else edge)),  # the mean of the newest is 0.05
        (0.0, 0.1, 1.05 - 0.1 * newest),  # it went from 0 to 0
        (0.3, 0.0, 0.95 + 0.3 * before),  # 0.15, from 0 to 0.3
    ):
        assert native.set(value) == native.set_rates(rate / STEP) == OK
        assert native.do_step(native.time(), STEP) == OK
        assert native.get(1) == [pytest.approx(expected, abs=1e-6)]


def test_input_under_first_order_hold_ends_where_its_derivative_leads(load: Load) -> None:
    native = load(sum_surrogate(1, hold="first_order")).instance().start()
    for length in (1, 2, 0.4):
        assert native.set(3.0) == native.set_rates(0.5 / STEP) == OK
        assert native.do_step(native.time(), length * STEP) == OK
        assert native.get(1) == [pytest.approx(3 + 0.5 * length)]


def test_input_derivative_counts_for_one_step_alone(load: Load) -> None:
    loaded = load(sum_surrogate())
    native, other = (loaded.instance().start() for _ in range(2))
    native.set_rates(9.0)
    native.step(0.5)
    native.step(0.5)
    other.step(0.5 + 4.5 * STEP)
    other.step(0.5)
    other.steps = 2
    for _ in range(3):
        native.step()
        other.step()
    assert native.get(1) == other.get(1)
    assert native.get(0) == [0.5]


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_input_derivative_of_zero_changes_nothing(load: Load, hold: Hold) -> None:
    loaded = load(random_surrogate(Shape(n_inputs=2, positions=3, cell=LASTING, hold=hold)))
    native, other = (loaded.instance().start() for _ in range(2))
    rng = np.random.default_rng(3)
    for row, length in zip(drawn(30, 2), rng.choice([1, 1, 3, 0.6], 30), strict=True):
        assert native.set(*row) == other.set(*row) == native.set_rates(0.0, 0.0) == OK
        assert native.do_step(native.time(), length * STEP) == OK
        assert other.do_step(other.time(), length * STEP) == OK
        assert native.save() == other.save()


@both_holds
@pytest.mark.parametrize("cell", [None, LASTING], ids=["layers", "cell"])
def test_input_derivatives_are_part_of_a_saved_state(
    load: Load, cell: CellShape | None, hold: Hold
) -> None:
    loaded = load(random_surrogate(Shape(positions=3, cell=cell, hold=hold, differences=1)))
    native, other = loaded.instance().start(), loaded.instance()
    for row, length in zip(drawn(12, 1), [1, 1, 2, 0.6] * 3, strict=True):
        assert native.set(*row) == native.set_rates(40.0) == OK
        assert other.restore(native.save()) == OK
        for one in (native, other):
            assert one.do_step(one.time(), length * STEP) == OK
        assert native.save() == other.save()
    native.set_rates(40.0)
    assert native.reset() == OK
    assert native.save() == loaded.instance().save()


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_failed_step_with_input_derivatives_changes_nothing(load: Load, hold: Hold) -> None:
    loaded = load(random_surrogate(Shape(n_in=8, hold=hold, cell=CellShape(activation="cubic"))))
    native, other = loaded.instance().start(), loaded.instance().start()
    for good in (3, 1, 2.6, 1):
        for one in (native, other):
            assert one.set(0.5) == one.set_rates(1e45) == OK
        for length in (1, 2, 1.6, 2.5, 30):
            assert native.do_step(native.time(), length * STEP) == ERROR
            assert "not finite" in native.messages[-1]
            assert native.get(1) == other.get(1)
            assert derivative(native, 1, np.ones(1)) == derivative(other, 1, np.ones(1))
        for one in (native, other):
            assert one.set_rates(3.0) == one.do_step(one.time(), good * STEP) == OK
        assert native.get(1) == other.get(1)


def test_input_derivatives_with_wrong_arguments_are_refused(rich: ExportedFmu) -> None:
    native = rich.instance().start()
    native.step(0.1, 0.2)
    saved = native.save()
    for rate in (math.nan, math.inf):
        assert native.set_rates(1.0, rate) == DISCARD
        assert f"derivative of value reference 1 = {rate:g}" in native.messages[-1]
    assert native.set_rates(1.0, order=0) == ERROR
    assert "derivative of order 0 of value reference 0; expected order 1" in native.messages[-1]
    assert native.set_rates(1.0, first=2) == ERROR
    assert "value reference 1000000 is no input; expected 0 to 1" in native.messages[-1]
    assert native.call("fmi2SetRealInputDerivatives", None, 1, None, None) == ERROR
    assert native.save() == saved
    native.call("fmi2Terminate")
    assert native.set_rates(1.0) == ERROR


def test_input_derivatives_of_higher_order_are_not_used(rich: ExportedFmu) -> None:
    """A warning where they are not zero; the first one counts all the same."""
    native, first_only = (rich.instance().start() for _ in range(2))
    both = (ctypes.c_uint * 2)(0, 0), ctypes.c_size_t(2), (ctypes.c_int * 2)(1, 2)
    for second, status in ((0.0, OK), (7.0, WARNING)):
        rates = (ctypes.c_double * 2)(3.0, second)
        assert native.call("fmi2SetRealInputDerivatives", *both, rates) == status
        assert first_only.set_rates(3.0) == OK
        native.step()
        first_only.step()
        assert native.save() == first_only.save()
    assert "order 2 of value reference 0; only order 1 is used" in native.messages[-1]


OF_WINDOW = 0.05
"""What networks, which forget slowly, know of inputs before their window."""

LENGTHS = [1, 1, 3, 0.02, 0.01, 1, 0.6, 5, 2.3, 7.7, 11, 1]


def moved_outputs(
    native: Native,
    before: bytes,
    inputs: FloatArray,
    rates: FloatArray,
    length: float,
    n_outputs: int = 2,
) -> FloatArray:
    """Outputs of a step that begins with a saved state."""
    assert native.restore(before) == OK
    assert native.set(*inputs) == native.set_rates(*rates) == OK
    assert native.do_step(native.time(), length * STEP) == OK, native.messages
    return np.array(native.get(len(inputs), n_outputs))


@both_holds
@pytest.mark.parametrize("first", LENGTHS[::3])
@pytest.mark.parametrize("family", ["elu block", "tanh cell"])
@pytest.mark.parametrize("seen", ["differences", "director"])
def test_output_derivatives_under_moving_inputs_are_those_of_rollback(
    load: Load, seen: str, family: str, first: float, hold: Hold
) -> None:
    """By the inputs that were set, with their rates kept, against rollback; also of the first
    step, before which its inputs count as held."""
    surrogate = surrogate_of(seen, family, hold=hold, n_in=24)
    native, distance = load(surrogate).instance(held=False).start(), 2e-3
    lengths = [first, *LENGTHS]
    rows, rates = inputs_for(surrogate, len(lengths)), rates_for(lengths, 2)
    direction, n_jumps = np.array([0.7, -1.0]), 0
    for row, slope, length in zip(rows, rates, lengths, strict=True):
        before = native.save()

        def output(
            amount: float,
            before: bytes = before,
            row: FloatArray = row,
            slope: FloatArray = slope,
            length: float = length,
        ) -> FloatArray:
            return moved_outputs(native, before, row + amount * direction, slope, length)

        expected, near = (five_point_slope(output, d) for d in (distance, distance / 4))
        if jumps(expected, near):
            n_jumps += 1
            continue
        values = moved_outputs(native, before, row, slope, length)
        allowed = 20 * ROUNDED * (1 + np.abs(values).max()) / distance
        if "cell" in family and n_phases(length) == 0:
            allowed += OF_WINDOW  # between phases, derivatives are those of the window
        found = derivative(native, 2, direction)
        np.testing.assert_allclose(found, expected, rtol=2e-2, atol=allowed)
    assert n_jumps <= len(lengths) // 4


def jumps(slope: FloatArray, near: FloatArray) -> bool:
    """Do outputs jump, since a held input just begins or ends to bend smoothly?"""
    return not np.allclose(slope, near, rtol=2e-2, atol=5e-3)


@pytest.mark.parametrize("parts", [1, 2, 4])
def test_derivatives_at_the_peaks_of_a_triangle_are_those_of_rollback(
    load: Load, parts: int
) -> None:
    """Where the input turns, the parts before and after have the same value."""
    surrogate = random_surrogate(Shape(activation="elu", hidden=(9, 5)))
    native, distance, length = load(surrogate).instance(held=False).start(), 2e-3, 1 / parts
    n_jumps = 0
    for k in range(12 * parts):
        rate = (1 if k // (3 * parts) % 2 == 0 else -1) * 0.2 / STEP
        value = 0.6 - abs(k % (6 * parts) - 3 * parts) * 0.2 * length
        before = native.save()

        def output(
            amount: float, before: bytes = before, value: float = value, rate: float = rate
        ) -> FloatArray:
            return moved_output(native, before, value + amount, rate, length)

        expected, near = (five_point_slope(output, d) for d in (distance, distance / 4))
        beside = (output(distance / 4) + output(-distance / 4)) / 2
        alone = not np.allclose(
            output(0.0), beside, rtol=0, atol=5e-6
        )  # a straight line is smooth
        if jumps(expected, near) or alone:
            n_jumps += 1
            continue
        moved_output(native, before, value, rate, length)
        found = derivative(native, 1, np.ones(1))
        np.testing.assert_allclose(found, expected, rtol=2e-2, atol=40 * ROUNDED / distance)
    assert n_jumps <= 10 * parts + 1


def moved_output(
    native: Native, before: bytes, value: float, rate: float, length: float
) -> FloatArray:
    return moved_outputs(native, before, np.array([value]), np.array([rate]), length, 1)


def test_input_derivatives_set_through_fmpy_are_resampled(load: Load) -> None:
    """By fmpy's own call; its simulate_fmu gives none (0.3.32 fails on an array of nine)."""
    surrogate, step = random_surrogate(Shape(cell=FORGETFUL)), 2 * STEP
    loaded, oracle = load(surrogate), MovingOracle(surrogate)
    (output,) = (v.reference for v in fmu_variables(surrogate) if v.name == "y0")
    slave = FMU2Slave(
        guid=loaded.guid,
        unzipDirectory=str(loaded.folder),
        modelIdentifier=surrogate.name,
        instanceName="one",
    )
    slave.instantiate()
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for k, (u, rate) in enumerate([(0.5, 9.0), (0.7, -20.0), (0.1, 40.0)]):
        slave.setReal([0], [u])
        slave.setRealInputDerivatives([0], [1], [rate])
        slave.doStep(k * step, step)
        outputs, _ = oracle.step(step, np.array([u]), np.array([rate])).results()
        assert slave.getReal([output]) == [pytest.approx(outputs[0], abs=2 * OUTPUT_TOLERANCE * 8)]
    slave.terminate()
    slave.freeInstance()
