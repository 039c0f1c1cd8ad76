"""Communication steps of any length against resampling in plain numpy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.core.signals import Hold
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from tests.fmu.any_step import (
    ESTIMATE_TOLERANCE,
    FORGETFUL,
    LASTING,
    NAMES,
    PATTERNS,
    SHAPES,
    both_holds,
    drawn,
    go,
    n_phases,
)
from tests.fmu.native import OK, Load
from tests.fmu.plain import ResamplingOracle
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate
from tests.marks import essential

HALVES = {"halves": [0.5], **PATTERNS}
"""Not where inputs are forecast: there, rounding decides between two forecasts at one step."""


@pytest.mark.extended
@both_holds
@pytest.mark.parametrize("pattern", essential(HALVES, "switching"))
@pytest.mark.parametrize("shape", SHAPES, ids=NAMES)
def test_step_of_any_length_gives_what_resampling_gives(
    load: Load, shape: Shape, pattern: str, hold: Hold
) -> None:
    surrogate = random_surrogate(dataclasses.replace(shape, hold=hold))
    lengths = (HALVES[pattern] * 60)[:60]
    inputs = drawn(60, shape.n_inputs)
    oracle, n = ResamplingOracle(surrogate), shape.n_outputs
    found = go(load(surrogate).instance().start(), lengths, inputs, 2 * n + 1)
    expected = [
        oracle.step(length * STEP, row) for length, row in zip(lengths, inputs, strict=True)
    ]
    outputs = np.array([output for output, _ in expected])
    estimates = np.array([estimate for _, estimate in expected])
    # between phases, outputs of cells are interpolated
    whole = [shape.cell is None or n_phases(length) > 0 for length in lengths]
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(
        found[whole, :n], outputs[whole], rtol=0, atol=2 * OUTPUT_TOLERANCE * 8
    )
    np.testing.assert_allclose(found[whole, n : 2 * n], estimates[whole], rtol=ESTIMATE_TOLERANCE)
    seen = np.cumsum(lengths) / surrogate.network.memory_length
    np.testing.assert_allclose(found[:, 2 * n], np.minimum(seen, 1))


@pytest.mark.parametrize("parts", [1, 2, 4])
def test_estimates_of_held_inputs_are_those_of_their_samples(load: Load, parts: int) -> None:
    """A change within a sample is felt in those before it. But all was known of the inputs: what
    became of earlier outputs says nothing of this one."""
    surrogate = random_surrogate(Shape(n_inputs=2, n_outputs=2, positions=4))
    native, oracle = load(surrogate).instance().start(), ResamplingOracle(surrogate)
    inputs = drawn(60, 2)
    found = go(native, [1 / parts] * 60, inputs, 4)
    for k, row in enumerate(inputs):
        _, estimate = oracle.step(STEP / parts, row)
        assert estimate is not None
        np.testing.assert_allclose(found[k, 2:], estimate, rtol=1e-3, err_msg=f"{k}")


@both_holds
@pytest.mark.parametrize("cell", [None, LASTING], ids=["layers", "cell"])
@pytest.mark.parametrize("count", [2, 3, 12])
def test_step_of_several_samples_gives_what_as_many_single_steps_give(
    load: Load, cell: CellShape | None, count: int, hold: Hold
) -> None:
    surrogate = random_surrogate(Shape(positions=3, cell=cell, hold=hold, differences=1))
    loaded, inputs = load(surrogate), drawn(20, 1)
    variables = 5 if cell else 4
    found = go(loaded.instance().start(), [count] * 20, inputs, variables)
    before = np.concatenate([inputs[:1], inputs[:-1]]) if hold == "first_order" else inputs
    parts = np.arange(count - 1, -1, -1) / count
    singles = inputs[:, None] - parts[:, None] * (inputs - before)[:, None]
    single = go(
        loaded.instance().start(), [1] * 20 * count, singles.reshape(-1, 1), 5 if cell else 4
    )
    np.testing.assert_array_equal(found, single[count - 1 :: count])


def test_switching_of_step_lengths_stays_within_the_truncation_error(load: Load) -> None:
    """h, 0.6 h, h again: outputs stay within the measured truncation error of the exact window,
    which the first step in each phase of time gives."""
    surrogate = random_surrogate(Shape(cell=LASTING))
    native, oracle = load(surrogate).instance().start(), ResamplingOracle(surrogate)
    lengths = [1.0] * 30 + [0.6] * 30 + [1.0] * 30
    inputs = drawn(len(lengths), 1)
    found = go(native, lengths, inputs, 3)
    exact = np.array(
        [oracle.step(length * STEP, row)[0] for length, row in zip(lengths, inputs, strict=True)]
    )
    deviation, measured = np.abs(found[:, 0] - exact[:, 0]), np.max(found[:, 2])
    assert 0.01 < measured < 0.5
    assert np.max(deviation) < 2 * measured
    assert np.max(deviation[30:34]) < OUTPUT_TOLERANCE * 8
    assert np.max(deviation[34:60]) > OUTPUT_TOLERANCE * 8


def test_truncation_error_stays_in_a_new_phase_until_it_is_measured_there(load: Load) -> None:
    """A window after the first step in the phase."""
    shape = Shape(cell=LASTING, differences=1)
    native = load(random_surrogate(shape)).instance().start()
    measured = go(native, [1] * 30, drawn(30, 1), 3)[-1, 2]
    assert measured > 1e-3
    # four new phases come before that of the whole steps; each has a sample in three steps of five
    found = go(native, [0.6] * 100, drawn(100, 1), 3)[:, 2]
    assert np.all(found[:4] == measured)
    of_phase = found[0::5]
    assert np.all(of_phase[:4] == measured)
    assert np.all(of_phase[5:] != measured)


def test_step_of_many_windows_ends_in_the_response_to_a_held_input(load: Load) -> None:
    native = load(sum_surrogate()).instance().start()
    assert go(native, [1, 2.0**32, 1], np.array([[1.0], [0.5], [0.25]])).tolist() == [
        [4.0],
        [2.0],
        [1.75],
    ]


def test_short_steps_are_joined_without_loss_on_a_line(load: Load) -> None:
    """Steps of h / 40 under an input that grows linearly: the remembered points are fewer."""
    surrogate = random_surrogate(Shape(hold="first_order"))
    native, oracle = load(surrogate).instance().start(), ResamplingOracle(surrogate)
    count = 40 * 18
    inputs = np.linspace(-2, 3, count)[:, None]
    found = go(native, [1 / 40] * count, inputs)
    for k in range(count):
        expected, _ = oracle.step(STEP / 40, inputs[k])
        if k % 97 == 0 or k > count - 5:
            assert found[k] == pytest.approx(expected, abs=2 * OUTPUT_TOLERANCE * 8)


@pytest.mark.parametrize("parts", [5, 10, 30, 100])
def test_small_steps_of_a_held_input_lose_nothing(load: Load, parts: int) -> None:
    """An importer with a small step, whose input changes once in h."""
    loaded = load(random_surrogate(Shape(n_in=20, n_out=4, cell=FORGETFUL)))
    inputs = drawn(80, 1)
    whole = go(loaded.instance().start(), [1] * 80, inputs)
    often = np.repeat(inputs, parts, axis=0)
    small = go(loaded.instance().start(), [1 / parts] * 80 * parts, often)
    assert small[parts - 1 :: parts] == pytest.approx(whole, abs=4 * OUTPUT_TOLERANCE * 8)


def test_shorter_steps_than_a_thirty_second_are_joined(load: Load) -> None:
    """Of an input that changes in every step; each sample is off by less than a joined step."""
    native, oracle = (
        load(sum_surrogate(20)).instance().start(),
        ResamplingOracle(sum_surrogate(20)),
    )
    count = 80 * 15
    inputs = np.linspace(-1, 1, count)[:, None]
    found = go(native, [1 / 80] * count, inputs)
    slope = 80 * (inputs[1] - inputs[0])  # per h
    for k, row in enumerate(inputs[: count // 2]):
        oracle.append(STEP / 80, row)
        if k % 7 == 0:  # comes at all times within a sample
            off = np.abs(found[k] - oracle.results()[0])
            assert off.max() < 20 * slope * (1 / 32 + 1 / 80)


@pytest.mark.parametrize("long", [9.5, 10.0, 20.5])
@pytest.mark.parametrize("short", [0.03, 0.032, 0.01])
def test_jump_under_first_order_hold_in_a_short_step_stays_short(
    load: Load, short: float, long: float
) -> None:
    """A tiny step at an event, then a long one: the jump does not last as long as that."""
    surrogate = sum_surrogate(hold="first_order")
    native = load(surrogate).instance().start()
    found = go(native, [1, 1, short, long], np.array([[0.0], [0.0], [1.0], [1.0]]))
    assert found[-1] == [4.0]


@pytest.mark.parametrize("scale", [np.float64(np.float32(STEP)) / STEP, 1 - 1e-7, 1 + 5e-7])
def test_step_that_is_roughly_h_counts_as_h(load: Load, scale: float) -> None:
    """The time is the importer's; samples are one h apart."""
    native, count = load(random_surrogate(Shape(cell=FORGETFUL))).instance().start(), 2000
    for k in range(count):
        assert native.do_step(k * STEP * scale, STEP * scale) == OK, native.messages
    assert native.time() == pytest.approx(count * STEP * scale, rel=1e-12)


def test_tiny_step_after_a_summed_time_is_accepted(load: Load) -> None:
    """An importer that adds up its time is off a little; a tiny step makes that no error."""
    native, time = load(random_surrogate(Shape(cell=FORGETFUL))).instance().start(), 0.0
    for _ in range(20_000):
        assert native.do_step(time, STEP) == OK
        time += STEP
    time += 2e-9
    for length in (1e-8, STEP, STEP):
        assert native.do_step(time, length) == OK, native.messages
        time += length


@pytest.mark.parametrize(
    "shape",
    [
        Shape(positions=3, hold="first_order"),
        Shape(positions=20, estimator_samples=4, cell=LASTING, differences=1),
        Shape(
            positions=3,
            features="chain",
            cell=dataclasses.replace(LASTING, activation="gated", turned=2, factors=1),
        ),
    ],
    ids=["layers", "cells", "gated"],
)
def test_state_saved_at_any_phase_is_restored_to_the_bit(load: Load, shape: Shape) -> None:
    """Before and in the fade, at the hand-over, after odd steps: saved, restored, gone on."""
    loaded = load(random_surrogate(shape))
    one, other = loaded.instance().start(), loaded.instance()
    rng = np.random.default_rng(2)
    lengths = [1.0] * 30 + rng.choice([1, 1, 2, 0.6, 0.5, 0.5, 0.1, 17], 60).tolist()
    inputs = drawn(len(lengths), 1)
    variables = 4 + (shape.cell is not None)
    for k, length in enumerate(lengths):
        saved = one.save()
        ahead = [go(one, lengths[k : k + 8], inputs[k : k + 8], variables)]
        end = one.save()
        assert other.restore(saved) == OK
        assert other.save() == saved
        ahead.append(go(other, lengths[k : k + 8], inputs[k : k + 8], variables))
        assert np.array_equal(*ahead)
        assert other.save() == end
        assert one.restore(saved) == OK
        go(one, [length], inputs[k : k + 1])
