"""Steps go on in the phase of time in which they end, against plain loops in numpy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import FORGETFUL, LASTING, both_holds, drawn, go
from tests.fmu.future import future
from tests.fmu.moving_inputs import HELD, MOVED, MovingOracle, forecasting, moving_inputs
from tests.fmu.native import ERROR, OK, Load, Native
from tests.fmu.native3 import instance_of
from tests.fmu.phases import PlainPhases
from tests.fmu.plain import ResamplingOracle
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate
from tests.marks import essential

TOLERANCE = 2 * OUTPUT_TOLERANCE * 8
"""Of outputs, whose range is 8."""

LENGTHS: dict[str, list[float]] = {
    "halves": [1 / 2],
    "thirds": [1 / 3],
    "fifths": [1 / 5],
    "tenths": [1 / 10],
    "six_tenths": [0.6],
    "three": [3],
    "three_halves": [1.5],
    "switching": [1] * 14 + [1 / 4] * 30 + [3, 1, 1.5, 0.6, 0.6, 0.1, 15, 1, 0.5] + [1 / 3] * 40,
}
CELL = Shape(n_inputs=2, n_outputs=2, cell=LASTING, differences=1)
SHAPES = {
    "cell": CELL,
    "layers": Shape(n_inputs=2, n_outputs=2, differences=1),
    "director": Shape(n_inputs=2, n_outputs=2, features="director", cell=LASTING),
}
STEPS = 150
CASES = [f"{shape}-{name}" for shape in SHAPES for name in LENGTHS]
of_cases = pytest.mark.parametrize(
    "case",
    essential(
        CASES,
        *("cell-tenths", "cell-six_tenths", "cell-switching"),
        *("layers-switching", "director-switching"),
    ),
)


def shape_of(case: str) -> Shape:
    return SHAPES[case.partition("-")[0]]


def lengths_of(case: str) -> list[float]:
    return (LENGTHS[case.partition("-")[2]] * STEPS)[:STEPS]


def agrees(native: Native, oracle: PlainPhases, lengths: list[float], rows: FloatArray) -> None:
    """Outputs and, of cells, truncation errors."""
    n_outputs = len(oracle.surrogate.outputs)
    is_cell = isinstance(oracle.surrogate.network, StateSpace)
    found = go(native, lengths, rows, 2 * n_outputs + 1 if is_cell else n_outputs)
    for k, (length, row) in enumerate(zip(lengths, rows, strict=True)):
        outputs, errors = oracle.step(length, row)
        expected = [*outputs, found[k, n_outputs], *errors] if is_cell else outputs
        np.testing.assert_allclose(found[k], expected, rtol=0, atol=TOLERANCE, err_msg=f"step {k}")


@both_holds
@of_cases
def test_steps_under_known_inputs_go_on_in_their_phase(load: Load, case: str, hold: Hold) -> None:
    """Inputs that are held, or reached at the end of the step."""
    surrogate = random_surrogate(dataclasses.replace(shape_of(case), hold=hold))
    native = load(surrogate).instance().start()
    agrees(native, PlainPhases(surrogate, known=True), lengths_of(case), drawn(STEPS, 2))


@of_cases
def test_steps_of_forecast_inputs_go_on_in_their_phase(load: Load, case: str) -> None:
    """Samples that were forecast are seen again, on the polynomial through what was set since."""
    shape = dataclasses.replace(shape_of(case), hold="first_order")
    surrogate = forecasting(random_surrogate(shape))
    native = load(surrogate).instance().start()
    agrees(native, PlainPhases(surrogate), lengths_of(case), moving_inputs(surrogate, STEPS))


@pytest.mark.parametrize(
    "case",
    essential(
        [f"{shape}-{name}" for shape in SHAPES for name in ("six_tenths", "fifths")],
        *("cell-six_tenths", "director-fifths"),
    ),
)
def test_steps_under_known_smooth_inputs_are_on_curves(load: Load, case: str) -> None:
    """Samples lie within steps of which no whole number makes up a sample."""
    surrogate = random_surrogate(dataclasses.replace(shape_of(case), hold="first_order"))
    surrogate = forecasting(surrogate, at_step_end=True)
    native = load(surrogate).instance().start()
    rows = moving_inputs(surrogate, STEPS)
    agrees(native, PlainPhases(surrogate, known=True), lengths_of(case), rows)


@of_cases
def test_held_inputs_that_move_smoothly_go_on_between_communication_points(
    load: Load, case: str
) -> None:
    """They are smooth, then noisy, then at rest, then smooth again."""
    shape = shape_of(case)
    surrogate = random_surrogate(shape)
    native = load(surrogate).instance(held=False).start()
    oracle, rows = PlainPhases(surrogate), moving_inputs(surrogate, STEPS)
    agrees(native, oracle, lengths_of(case), rows)
    if shape.features != "director":
        ways = np.array(oracle.inputs.ways)
        assert np.any(ways == MOVED)
        assert np.any(ways == HELD)


@pytest.mark.parametrize("length", [1, 1 / 2])
@pytest.mark.parametrize("width", [6, 7, 8])
def test_short_pulse_of_a_held_input_leaves_its_rests_as_they_are(
    load: Load, width: int, length: float
) -> None:
    """It turns out to be smooth when it is over; the long rest before it did not move."""
    surrogate = random_surrogate(SHAPES["cell"])
    native = load(surrogate).instance(held=False).start()
    pulse = np.sin(np.pi * np.arange(width) / width)
    rows = np.zeros((60, 2))
    rows[20 : 20 + width] = 0.4 * pulse[:, None]
    agrees(native, PlainPhases(surrogate), [length] * len(rows), rows)


@pytest.mark.parametrize("parts", [2, 3, 5, 10])
@both_holds
def test_parts_of_a_step_give_the_whole_window_of_a_network_that_forgets(
    load: Load, parts: int, hold: Hold
) -> None:
    shape = Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL, differences=2, positions=3)
    surrogate = forecasting_as(shape, hold)
    native, oracle = load(surrogate).instance(held=False).start(), MovingOracle(surrogate)
    rows = moving_inputs(surrogate, 20 * parts)
    found = go(native, [1 / parts] * len(rows), rows, 2)
    for k, row in enumerate(rows):
        outputs, _ = oracle.step(STEP / parts, row).results()
        # that inputs move after a rest is told late: the oldest sample that this changes stays
        late = hold == "zero_order" and parts == 3 and k > 15 * parts
        near = 1e-2 if late else TOLERANCE
        np.testing.assert_allclose(found[k], outputs, rtol=0, atol=near, err_msg=f"step {k}")


def forecasting_as(shape: Shape, hold: Hold) -> Surrogate:
    surrogate = random_surrogate(dataclasses.replace(shape, hold=hold))
    return surrogate if hold == "zero_order" else forecasting(surrogate)


@pytest.mark.parametrize(
    ("milliseconds", "exact"),
    [
        (20, True),
        pytest.param(12, True, marks=pytest.mark.extended),
        pytest.param(23, False, marks=pytest.mark.extended),
    ],
)
def test_steps_of_a_millisecond_are_exact_up_to_twenty_in_a_sample(
    load: Load, milliseconds: int, exact: bool
) -> None:
    surrogate = random_surrogate(Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL))
    window = dataclasses.replace(surrogate.window, step=1e-3 * milliseconds)
    surrogate = dataclasses.replace(surrogate, window=window)
    native, oracle = load(surrogate).instance(held=True).start(), ResamplingOracle(surrogate)
    rows, far = drawn(12 * milliseconds, 2), []
    for row, found in zip(rows, go(native, [1e-3 / STEP] * len(rows), rows, 2), strict=True):
        far.append(np.max(np.abs(oracle.step(1e-3, row)[0] - found)))
    assert (max(far) < TOLERANCE) == exact


@both_holds
@pytest.mark.parametrize("lengths", [[0.17], [1 / 13], [0.37, 0.71, 1.3], [2.3]])
def test_irregular_steps_of_smooth_inputs_give_the_whole_window(
    load: Load, lengths: list[float], hold: Hold
) -> None:
    """They come through more phases than are kept: outputs are interpolated between five. What is
    smooth within a sample, and what is not, may differ from one of these to the next."""
    shape = Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL)
    surrogate = forecasting_as(shape, hold)
    native, oracle = load(surrogate).instance(held=False).start(), MovingOracle(surrogate)
    count = int(40 / np.mean(lengths))
    steps = (lengths * count)[:count]
    times = np.cumsum([0.0, *steps[:-1]])[:, None]
    scaling = surrogate.input_scaling
    rows = scaling.invert(0.8 * np.sin(times * np.array([0.25, 0.2]) + np.array([0.3, 1.0])))
    found, spread, off = go(native, steps, rows, 2), [], []
    for k, (length, row) in enumerate(zip(steps, rows, strict=True)):
        oracle.step(length * STEP, row)
        if k > count // 2:
            outputs, _ = oracle.results()
            spread.append(outputs)
            off.append(np.abs(found[k] - outputs).max())
    assert np.ptp(spread) > 0.1
    assert np.median(off) < 1e-4
    assert max(off) < (1e-3 if hold == "first_order" or max(lengths) > 0.2 else 3e-2)


@pytest.mark.extended
@both_holds
def test_mixed_steps_of_smooth_inputs_give_the_whole_window(load: Load, hold: Hold) -> None:
    """Most steps end where no phase is: after some that saw all anew, outputs are interpolated."""
    surrogate = forecasting_as(Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL), hold)
    native, oracle = load(surrogate).instance(held=False).start(), MovingOracle(surrogate)
    lengths = np.random.default_rng(1).choice([1, 1 / 2, 1 / 4, 1 / 5, 1 / 8, 0.3], 400)
    times = np.cumsum([0.0, *lengths[:-1]])[:, None]
    scaled = 0.8 * np.sin(times * np.array([0.15, 0.12]) + np.array([0.3, 1.0]))
    rows, spread = surrogate.input_scaling.invert(scaled), []
    found = go(native, lengths, rows, 2)
    for k, (length, row) in enumerate(zip(lengths, rows, strict=True)):
        oracle.step(float(length) * STEP, row)
        if k > 200:
            outputs, _ = oracle.results()
            spread.append(outputs)
            near = 1e-3 if hold == "first_order" else 2e-2
            np.testing.assert_allclose(found[k], outputs, rtol=0, atol=near, err_msg=f"{k}")
    assert np.ptp(spread) > 1


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("shape", [SHAPES["cell"], SHAPES["layers"]], ids=["cell", "layers"])
def test_stairs_at_a_tenth_of_the_step_lose_nothing(load: Load, shape: Shape, held: bool) -> None:
    """Random heights do not move smoothly, also where a shorter step begins."""
    loaded, stairs = load(random_surrogate(shape)), drawn(60, 2)
    whole = go(loaded.instance().start(), [1] * 60, stairs, 2)
    native = loaded.instance(held=held).start()
    begun = go(native, [1] * 20, stairs[:20], 2)
    tenths = go(native, [1 / 10] * 400, np.repeat(stairs[20:], 10, axis=0), 2)
    np.testing.assert_allclose([*begun, *tenths[9::10]], whole, rtol=0, atol=TOLERANCE)


def test_sine_that_is_set_often_is_held_at_what_has_its_effect(load: Load) -> None:
    """The sum of four samples: a hold makes a sine smaller by sin(x) / x, x = w h / 2."""
    native = load(sum_surrogate()).instance(held=False).start()
    times = np.arange(0, 40, 1 / 4)
    found = go(native, [1 / 4] * len(times), np.sin(times / 5)[:, None])
    ends = times[40:] + 1 / 4
    middles = np.array([np.sin((ends - age - 0.5) / 5) for age in range(4)])
    expected = middles.sum(axis=0) * 0.1 / np.sin(0.1)
    np.testing.assert_allclose(found[40:, 0], expected, atol=1e-5)
    assert np.abs(middles.sum(axis=0) - expected).max() > 1e-3


@both_holds
@pytest.mark.parametrize("length", [1 / 3, 0.6, 3, 0.17])
def test_state_goes_on_to_the_bit_at_any_phase(load: Load, length: float, hold: Hold) -> None:
    """Saved, restored in another instance, gone back to, and reset."""
    surrogate = forecasting_as(dataclasses.replace(CELL, positions=2), hold)
    loaded, rows = load(surrogate), moving_inputs(surrogate, 70)
    one, other = (loaded.instance(held=False).start() for _ in range(2))
    go(other, [0.7] * 5, rows[:5])
    fresh = go(one, [length] * 40, rows[:40], 4)
    saved = one.save()
    expected = go(one, [length] * 30, rows[40:], 4)
    for again in (one, other):
        assert again.restore(saved) == OK
        assert again.save() == saved
        np.testing.assert_array_equal(go(again, [length] * 30, rows[40:], 4), expected)
    assert one.call("fmi2Reset") == OK
    np.testing.assert_array_equal(go(one.start(), [length] * 40, rows[:40], 4), fresh)


def test_state_of_a_short_window_has_all_that_later_steps_look_back_at(load: Load) -> None:
    """Of a held input that moves smoothly also how it bent before the samples that are open; the
    other instance has nothing of what the first one had earlier."""
    shape = Shape(n_in=2, n_out=1, n_inputs=2, n_outputs=2, differences=1, cell=CellShape())
    surrogate = random_surrogate(shape)
    loaded = load(surrogate)
    one = loaded.instance(held=False).start()
    lengths, sine = [0.19] * 29 + [3.0] * 18 + [0.5] * 18, np.sin(0.1 * np.arange(65))
    jumps = np.repeat([-1.2, 1.1, -1.7], [48, 8, 9])
    rows = np.stack([jumps, sine], axis=1)
    go(one, lengths[:47], rows[:47])
    for k in range(47, 65):
        other = loaded.instance(held=False).start()
        go(other, [1] * 20, drawn(20, 2))
        assert other.restore(one.save()) == OK
        length, row = lengths[k : k + 1], rows[k : k + 1]
        np.testing.assert_array_equal(go(other, length, row, 2), go(one, length, row, 2), f"{k}")


@both_holds
def test_both_standards_give_the_same_bits(load: Load, hold: Hold) -> None:
    surrogate = forecasting_as(dataclasses.replace(CELL, positions=2), hold)
    loaded, lengths = load(surrogate), lengths_of("cell-switching")
    two, three, time = loaded.instance(held=False).start(), instance_of(loaded, held=False), 0.0
    three.start()
    for length, row in zip(lengths, moving_inputs(surrogate, STEPS), strict=True):
        for native in (two, three):
            assert native.set(*row) == native.do_step(time, length * STEP) == OK
        assert two.get(2, 8) == three.get(2, 8)
        time += length * STEP


@both_holds
@pytest.mark.parametrize("length", [1 / 3, 1, 3])
def test_failed_step_leaves_the_phases(load: Load, length: float, hold: Hold) -> None:
    """To the bit: what follows, whether it begins with the step that failed or another one."""
    shape = Shape(n_inputs=2, n_outputs=2, cell=CellShape(activation="cubic"), positions=2)
    surrogate = forecasting_as(shape, hold)
    native, rows = load(surrogate).instance(held=False).start(), moving_inputs(surrogate, 40)
    go(native, [length] * 40, rows)
    row, time = tuple(rows[0]), native.time()
    native.set(1e30, -1e30)
    expected = future(native, time, row, 8)
    for failing in (length, 1, 0.6, 2.3, 0.17, 30):
        native.set(1e30, -1e30)
        assert native.do_step(time, failing * STEP) == ERROR
        assert future(native, time, row, 8) == expected, failing
