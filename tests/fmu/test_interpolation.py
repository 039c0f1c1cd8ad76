"""Steps that end between the phases of time, or hardly go on in one of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import Hold
from slide_fmu.fmu.export import read_fmu
from tests.bounded import bounded_surrogate
from tests.fmu.any_step import FORGETFUL, LASTING, both_holds, drawn, go
from tests.fmu.derivatives import derivatives
from tests.fmu.moving_inputs import MovingOracle, forecasting, moving_inputs
from tests.fmu.native import ERROR, OK, Load
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate
from tests.fmu.test_error_bounds import places, surrogate_of
from tests.fmu.test_moving_inputs import set_at_step_end
from tests.fmu.test_ranges import WIDE, reference

RELEASED = Path(__file__).parents[2] / "fmus"
PARTS = 25
"""Steps in a sample step: more than there are phases."""


@both_holds
@pytest.mark.parametrize("cell", [None, LASTING], ids=["layers", "cell"])
def test_time_goes_on_by_steps_that_are_hardly_longer_than_nothing(
    load: Load, cell: CellShape | None, hold: Hold
) -> None:
    """Many of them give what one step gives: they drag no phase along with them."""
    loaded = load(random_surrogate(Shape(cell=cell, hold=hold)))
    tiny, count = 8e-6, 6000
    one, many = loaded.instance().start(), loaded.instance().start()
    rows = drawn(20, 1)
    for native in (one, many):
        go(native, [1.0] * 20, rows)
    height = 3.0 if rows[-1] < 0.5 else -2.0
    before = many.get(1)
    expected = go(one, [count * tiny], np.array([[height]]))
    found = go(many, [tiny] * count, np.full((count, 1), height))
    assert found[-1] == pytest.approx(expected[0], abs=3e-4)
    assert abs(expected[0, 0] - before[0]) > 3e-3


@both_holds
@pytest.mark.parametrize("length", [0.37, 0.17, 1 / 13])
def test_step_that_fails_between_phases_gives_none_the_state_of_another(
    load: Load, length: float, hold: Hold
) -> None:
    """Soon after the start, all that was taken back is found again to the bit."""
    cell = CellShape(activation="cubic")
    shape = Shape(n_in=40, n_inputs=2, n_outputs=2, cell=cell, hold=hold)
    surrogate = random_surrogate(shape)
    surrogate = surrogate if hold == "zero_order" else forecasting(surrogate)
    loaded, rows = load(surrogate), moving_inputs(surrogate, 90)
    count = int(3 / length)
    clean, failing = (loaded.instance(held=False).start() for _ in range(2))
    for native in (clean, failing):
        go(native, [length] * count, rows[:count])
    assert failing.set(1e30, -1e30) == OK
    assert failing.do_step(failing.time(), length * STEP) == ERROR
    lengths, rest = [length] * 8 + [1.0] * 4, rows[count : count + 12]
    np.testing.assert_array_equal(go(failing, lengths, rest, 2), go(clean, lengths, rest, 2))


def test_step_that_fails_between_phases_leaves_derivatives(load: Load) -> None:
    cell = CellShape(activation="cubic")
    surrogate = random_surrogate(Shape(n_inputs=2, n_outputs=2, cell=cell))
    native, rows = load(surrogate).instance().start(), drawn(40, 2)
    go(native, [0.37] * 25, rows[:25])
    go(native, [0.5] * 15, rows[25:])
    expected = derivatives(native, 2, 2)
    native.set(1e30, -1e30)
    assert native.do_step(native.time(), 0.37 * STEP) == ERROR
    np.testing.assert_allclose(derivatives(native, 2, 2), expected, rtol=1e-6, atol=1e-9)


def test_input_out_of_range_counts_at_once_until_the_memory_has_lost_it(load: Load) -> None:
    """A moving input leaves its range for one call, which not every phase sees."""
    shape = Shape(n_in=8, n_out=2, cell=LASTING, hold="first_order")
    surrogate = dataclasses.replace(forecasting(random_surrogate(shape)), input_scaling=WIDE)
    native, place = load(surrogate).instance(held=False).start(), reference(surrogate)
    length, left, memory = 0.17, 120, surrogate.network.memory_length
    found = []
    for k in range(left + int((memory + 3) / length)):
        native.set(9.0 if k == left else 0.5)
        assert native.do_step(native.time(), length * STEP) == OK
        found += native.get(place)
    assert all(found[:left])
    assert not any(found[left : left + int(memory / length)])
    assert found[-1]


def test_held_inputs_that_jump_between_samples_act_at_their_time(load: Load) -> None:
    """Half a millisecond has more phases than are kept, a millisecond has not. With means of
    newest samples alone, outputs are off by a fortieth."""
    surrogate, _ = read_fmu(RELEASED / "duffing_10ms" / "duffing_10ms.fmu")
    loaded = load(surrogate)
    levels = np.random.default_rng(4).uniform(-800, 800, 500)  # N, each for 8 ms
    found = []
    for parts in (8, 16):
        native = loaded.instance(held=False).start()
        found.append([])
        for level in levels:
            native.set(level)
            for _ in range(parts):
                assert native.do_step(native.time(), 0.008 / parts) == OK
            found[-1] += native.get(1)
    exact, interpolated = np.array(found)[:, 100:]
    assert rms((interpolated - exact)[:, None])[0] < 1e-3 * np.std(exact)


def test_bound_knows_what_forecasts_missed_between_phases(load: Load) -> None:
    """An angle jumps a little, which no forecast knows: steps of 5 ms have phases of their own,
    those of 4.9 ms have none."""
    surrogate, _ = read_fmu(RELEASED / "slider_crank_20ms" / "slider_crank_20ms.fmu")
    loaded, place = load(surrogate), places(surrogate, "ERROR_BOUND")
    widths = []
    for step in (5.0e-3, 4.9e-3):
        bounds = []
        for known in (False, True):
            native = loaded.instance(held=False)
            if known:
                set_at_step_end(native, 1.0)
            native.start()
            times = step * np.arange(int(20 / step))
            angles = 3 * np.sin(0.4 * np.pi * times) + 0.02 * np.floor(2 * times + 1e-6)
            found = []
            for angle in angles:
                native.set(np.cos(angle), np.sin(angle))
                assert native.do_step(native.time(), step) == OK
                found.append(native.get(*place))
            bounds.append(rms(np.array(found)[len(found) // 2 :])[0])
        widths.append(bounds[0] / bounds[1])
    assert widths[0] > 3
    assert widths[1] == pytest.approx(widths[0], rel=0.4)


def test_novelty_is_the_largest_of_the_phases_behind_the_outputs(load: Load) -> None:
    """Inputs that change at fifths of a sample step only: steps of a fifth give each phase's."""
    surrogate = surrogate_of("plain")
    loaded, place = load(surrogate), places(surrogate, "NOVELTY")
    fifths, small = loaded.instance().start(), loaded.instance().start()
    rows = np.random.default_rng(3).uniform(-0.2, 1.2, (120, 2))
    alone, joined = [], []
    for row in rows:
        fifths.set(*row)
        assert fifths.do_step(fifths.time(), STEP / 5) == OK
        alone += fifths.get(*place)
        small.set(*row)
        for _ in range(PARTS // 5):
            joined += small.get(*place)
            assert small.do_step(small.time(), STEP / PARTS) == OK
    others = []
    for j in range(60, 119):  # after step j: at (j + 1) / 5 of a sample step
        found = joined[(j + 1) * (PARTS // 5) + 2]
        if j % 5 < 3:
            assert found >= alone[j] * (1 - 0.05)  # of open samples, one phase's count
            others.append(found > 1.01 * alone[j])
    assert any(others)


def test_many_new_phases_under_long_steps_leave_later_steps_their_own(load: Load) -> None:
    """Long steps take in all samples anew whatever that costs: half steps after them still go on
    in phases of their own, after at most a window for each."""
    surrogate = random_surrogate(Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL))
    native, oracle = load(surrogate).instance().start(), MovingOracle(surrogate, known=True)
    lengths = [3, 0.17] * 100 + [1, 0.33] + [0.5] * 100
    rows = drawn(len(lengths), 2)
    found = go(native, lengths, rows, 2)[-20:]
    newest = list(zip(lengths, rows, strict=True))[-150:]
    exact = [oracle.step(length * STEP, row).results()[0] for length, row in newest]
    np.testing.assert_allclose(found, exact[-20:], rtol=0, atol=2e-4)


def test_bound_before_the_first_sample_ends_is_that_of_the_start(load: Load) -> None:
    """Outputs lie between phases; reading it then changes nothing of what is read later."""
    surrogate = bounded_surrogate(
        Shape(n_in=3, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape(3, 4, contraction=0.9))
    )
    loaded, place = load(surrogate), places(surrogate, "ERROR_BOUND")
    one, other = loaded.instance().start(), loaded.instance().start()
    assert one.set(0.5, 0.5) == other.set(0.5, 0.5) == OK
    at_start = one.get(*place)
    for _ in range(3):
        go(one, [1e-4], np.full((1, 2), 0.5))
        assert one.get(*place) == at_start
    go(other, [1e-4] * 3, np.full((3, 2), 0.5))
    rows = np.concatenate([np.full((5, 2), 0.5), drawn(26, 2)])
    for native in (one, other):
        go(native, [0.999] * 31, rows)
    for row in drawn(8, 2):
        go(one, [0.17], row[None])
        go(other, [0.17], row[None])
        assert one.get(*place) == other.get(*place)
