"""Windows, states and instances of the native library."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from tests.fmu.any_step import LASTING, go
from tests.fmu.derivatives import derivative
from tests.fmu.moving_inputs import forecasting
from tests.fmu.native import ERROR, OK, ExportedFmu, Load, Native
from tests.fmu.samples import Shape, random_surrogate, sum_surrogate


def test_window_takes_the_input_that_is_set_before_each_step(summing: Native) -> None:
    results = []
    for _ in range(6):
        summing.step(1.0)
        results += summing.get(1)
    assert results == [1, 2, 3, 4, 4, 4]


def test_window_keeps_an_input_that_is_set_once(summing: Native) -> None:
    summing.set(1.0)
    results = []
    for _ in range(6):
        summing.step()
        results += summing.get(1)
    assert results == [1, 2, 3, 4, 4, 4]


def test_window_advances_though_no_output_is_read(summing: Native) -> None:
    for _ in range(4):
        summing.step(1.0)
    assert summing.get(1) == [4]


def test_window_advances_with_steps_only(summing: Native) -> None:
    for _ in range(3):
        summing.set(1.0)
        assert summing.get(1) == [0]
    summing.step()
    assert summing.get(1) == [1]


def test_window_after_a_rollback_is_that_of_the_saved_state(summing: Native) -> None:
    saved = summing.save()
    for _ in range(2):
        assert summing.restore(saved) == OK
        summing.steps = 1
        test_window_takes_the_input_that_is_set_before_each_step(summing)


def test_prehistory_before_the_first_step_is_the_first_input(load: Load) -> None:
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
    assert native.try_get(len(fmu_variables(surrogate)))[0] == ERROR


def test_outputs_in_initialization_mode_are_those_of_the_initial_inputs(load: Load) -> None:
    native = load(sum_surrogate()).instance()
    assert native.try_get(1)[0] == ERROR
    native.call("fmi2EnterInitializationMode")
    native.set(2.0)
    assert native.get(1) == [8.0]


def test_reset_gives_a_fresh_instance(rich: ExportedFmu) -> None:
    fresh = rich.instance()
    used = rich.instance().start(7.0)
    used.set(0.3, 0.4)
    assert used.do_step(7.0) == OK
    assert used.reset() == OK
    assert used.save() == fresh.save()


def test_state_is_bit_exact_in_another_instance(rich: ExportedFmu) -> None:
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


MOVING = Shape(n_inputs=2, positions=3, cell=LASTING, hold="first_order", differences=2)
CALLS = {
    "held": random_surrogate(Shape(n_inputs=2, positions=3, cell=LASTING)),
    "step_end": forecasting(random_surrogate(MOVING), at_step_end=True),
    "forecast": forecasting(random_surrogate(MOVING)),
}


@pytest.mark.parametrize("n_before", [1, 20, 1100], ids=["start", "window", "full"])
@pytest.mark.parametrize("call", CALLS)
def test_state_goes_on_in_an_instance_with_another_past(
    load: Load, call: str, n_before: int
) -> None:
    """Of former steps, a state has those only that results depend on: the other instance keeps
    its own where these were. 1100 short steps are more than there is room for."""
    loaded, rng = load(CALLS[call]), np.random.default_rng(6)
    one, other = loaded.instance().start(), loaded.instance().start()
    before = rng.choice([0.04, 0.3, 1, 2, 30], n_before)
    after = [0.5, 14, 0.1, 1, 0.4, 3, 0.04, 14, 1, 40, 0.2]
    times = np.cumsum([*before, *after])[:, None]
    rows = np.sin(times * [0.02, 0.01])  # such as a forecast foresees
    go(one, before, rows[:n_before])
    go(other, rng.choice([0.07, 1, 5], 1000), rng.uniform(-1, 1, (1000, 2)))
    saved = one.save()
    assert other.restore(saved) == OK
    assert other.save() == saved
    slopes = [derivative(native, 1, np.array([0.3, -1.0])) for native in (other, one)]
    np.testing.assert_array_equal(*slopes)
    ahead = rows[n_before:]
    np.testing.assert_array_equal(go(other, after, ahead), go(one, after, ahead))
    assert other.save() == one.save()


def test_damaged_states_are_refused(rich: ExportedFmu) -> None:
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
    inputs, found = np.random.default_rng(3).uniform(-2, 3, (20, len(natives))), []
    for row in inputs:
        for native, value in zip(natives, row, strict=True):
            native.step(value)
        found.append([native.get(1)[0] for native in natives])
    for index, (native, values) in enumerate(zip(natives, np.transpose(found), strict=True)):
        expected = loaded[index // 2].surrogate.predict_newest(inputs[:, index : index + 1])
        assert values == pytest.approx(expected[:, 0], abs=2e-6 * 8)
        native.free()


def test_instances_in_eight_threads_give_what_one_gives_alone(rich: ExportedFmu) -> None:
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
