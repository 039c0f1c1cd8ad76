"""Motions that are integrated at once are those that are integrated one after the other."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Hold, Signal
from slide_fmu.systems import simulation
from slide_fmu.systems.base import Motion, State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.integration import EXPLICIT, Solver
from slide_fmu.systems.function.lane_trial import ONE_BY_ONE
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.simulation import (
    motions_at_once,
    simulate,
    simulate_motion,
    simulate_motions,
    states_along,
)

STEP, SAMPLES = 0.05, 300
ROUNDING = 1e-12
"""Motions at once differ from those alone by this part of their largest output."""
Function = Callable[..., Any]


def rates(x: FloatArray, u: FloatArray, p: Any, du: FloatArray) -> list[Any]:
    """A driven pendulum with a stop that is stiff, and a first-order lag behind it."""
    stop = p.stop * np.where(np.abs(x[0]) > 1.0, x[0] - np.sign(x[0]), 0.0)
    return [x[1], u[0] + 0.02 * du[1] - p.gravity * np.sin(x[0]) - 0.6 * x[1] - stop, x[0] - x[2]]


def outputs(x: FloatArray, u: FloatArray, p: Any, du: FloatArray) -> list[Any]:
    return [x[0] * p.gravity, x[2] + u[1], 0.1 * du[1] + x[1] ** 3]


def system(
    f: Function = rates,
    g: Function = outputs,
    hold: Hold = "first_order",
    start: Sequence[float] = (0.0, 0.0, 0.0),
    n_outputs: int = 3,
    solver: Solver | None = None,
    **parameters: float,
) -> FunctionSystem:
    inputs = [Signal(name, unit="1", low=-2.0, high=2.0, hold=hold) for name in ("force", "base")]
    return FunctionSystem(
        f,
        g,
        inputs=inputs,
        outputs=[Signal(f"y{k}", unit="1", low=-1.0, high=1.0) for k in range(n_outputs)],
        start=list(start),
        step=STEP,
        parameters={"gravity": 4.0, "stop": 300.0, **parameters},
        solver=solver,
    )


def motion(number: int, samples: int = SAMPLES) -> Motion:
    """Give one of many motions: straight ones, such that bend, and such that jump, by turns."""
    rng = np.random.default_rng(number)
    time = STEP / 4 * np.arange(4 * samples)
    waves = np.sin(np.outer(time, rng.uniform(0.5, 8.0, 2)) + rng.uniform(0.0, 6.0, 2))
    bends = rng.uniform(0.2, 2.0) * waves
    if number % 3 == 0:
        return Motion(bends[3::4])
    if number % 3 == 1:
        return Motion(bends[3::4], between=bends)
    held = np.repeat(bends[3::40], 10, axis=0)
    changes = np.diff(held, axis=0, prepend=held[:1]) != 0.0
    at = np.where(changes, rng.choice([0.0, 0.3, 0.7, 1.0], changes.shape), np.nan)
    return Motion(held, jumps=at)


def answered(made: FunctionSystem, motions: Sequence[Motion]) -> list[FloatArray]:
    answers = list(simulate_motions(made, motions))
    assert all(isinstance(answer, np.ndarray) for answer in answers)
    return [answer for answer in answers if isinstance(answer, np.ndarray)]


def assert_same(made: FunctionSystem, motions: Sequence[Motion]) -> None:
    for each, answer in zip(motions, answered(made, motions), strict=True):
        alone = simulate_motion(made, each)
        assert np.max(np.abs(alone - answer)) <= ROUNDING * np.max(np.abs(alone))


@pytest.mark.parametrize("method", EXPLICIT)
def test_motions_at_once_are_those_alone(method: str) -> None:
    made = system(solver=Solver(method, 1e-4, 1e-7))
    assert made.most_at_once() > 100
    assert_same(made, [motion(number) for number in range(7)])


def test_motions_at_once_with_held_inputs_are_those_alone() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        return rates(x, u, p, np.zeros_like(u))

    def g(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        return [x[0], u[1] * x[2], 1.0]

    made = system(f, g, "zero_order")
    assert_same(made, [Motion(motion(number).inputs) for number in range(4)])


def test_motions_begin_at_the_states_they_name_and_may_differ_in_length() -> None:
    made = system()
    start = State(np.array([0.4, -1.0, 0.2]), np.zeros(0), np.array([0.3, 0.1]), np.ones(2))
    motions = [Motion(motion(3 * k, 10 + 290 * k).inputs, start if k else None) for k in range(3)]
    assert_same(made, motions)


@pytest.mark.parametrize("every", [1, 7, 300])
def test_states_along_motions_are_those_alone(every: int) -> None:
    made = system()
    motions = [Motion(motion(3 * number).inputs) for number in range(3)]
    for each, states in zip(motions, states_along(made, motions, every), strict=True):
        alone: list[State] = []
        simulate(made, each.inputs, made.rest_state(each.first_input), alone)
        assert len(states) == SAMPLES // every
        for one, other in zip(states, alone[every::every], strict=True):
            np.testing.assert_allclose(one.coordinates, other.coordinates, rtol=1e-9, atol=1e-11)
            np.testing.assert_array_equal(one.last_input, other.last_input)
            np.testing.assert_allclose(one.input_rate, other.input_rate, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("method", EXPLICIT)
def test_motion_does_not_depend_on_the_others_to_the_last_bit(method: str) -> None:
    made = system(solver=Solver(method, 1e-4, 1e-7))
    motions = [motion(number, 100) for number in range(64)]
    of_all = answered(made, motions)
    assert_bits(of_all[:7], answered(made, motions[:7]))
    assert_bits(of_all[5:6], answered(made, motions[5:6]))
    assert_bits(of_all, answered(made, motions[::-1])[::-1])


def assert_bits(first: Sequence[FloatArray], second: Sequence[FloatArray]) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


def test_product_of_matrices_gives_the_same_bits_in_any_company() -> None:
    """A library for products takes other ways for other numbers of lanes."""
    n = 24
    matrix = np.random.default_rng(0).normal(size=(n, n)) / n - np.eye(n)
    influence = np.random.default_rng(1).normal(size=(n, 2))

    def f(x: FloatArray, u: FloatArray, p: Any) -> FloatArray:
        return matrix @ x + influence @ u

    made = system(f, lambda x, u, p: x[:3] + 0.0, start=[0.0] * n)
    motions = [motion(3 * number, 60) for number in range(64)]
    of_all = answered(made, motions)
    assert_bits(of_all[:7], answered(made, motions[:7]))
    assert_bits(of_all[63:], answered(made, motions[63:]))
    assert_same(made, motions[:2])


def test_parameters_differ_from_motion_to_motion() -> None:
    values = np.linspace(2.0, 6.0, 5)
    base, systems = system(), [system(gravity=float(value)) for value in values]
    motions = [motion(number) for number in range(5)]
    assert motions_at_once(base, SAMPLES, 4, ["gravity"]) > 1
    answers = list(simulate_motions(base, motions, systems, ["gravity"]))
    for own, each, answer in zip(systems, motions, answers, strict=True):
        assert isinstance(answer, np.ndarray)
        alone = simulate_motion(own, each)
        assert np.max(np.abs(alone - answer)) <= ROUNDING * np.max(np.abs(alone))
    one = list(simulate_motions(base, motions[2:3], systems[2:3], ["gravity"]))
    np.testing.assert_array_equal(one[0], answers[2])


def rounded(error: SimulationError) -> str:
    """Give a message whose numbers have six digits, since their last ones differ."""
    return re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.6g}", str(error))


def runaway(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
    """It goes beyond all bounds where the force is large for long."""
    return [x[1], u[0] - x[0] - x[1] + x[0] ** 3, -x[2]]


def test_lane_that_fails_has_the_words_of_one_alone_and_disturbs_no_other() -> None:
    made = system(runaway, lambda x, u, p: list(x))
    motions = [Motion(0.2 * motion(number).inputs / (1 + number)) for number in range(6)]
    motions[2] = Motion(np.linspace([0.0, 0.0], [2.0, 0.0], SAMPLES))
    motions[4] = Motion(
        np.full((SAMPLES, 2), 2.0), State(np.ones(3), np.zeros(0), np.full(2, 2.0))
    )
    answers = list(simulate_motions(made, motions))
    for number in (2, 4):
        with pytest.raises(SimulationError) as alone:
            simulate_motion(made, motions[number])
        answer = answers[number]
        assert isinstance(answer, SimulationError)
        assert (rounded(answer), answer.time) == (rounded(alone.value), alone.value.time)
    good = [motions[number] for number in (0, 1, 3, 5)]
    kept = [answers[number] for number in (0, 1, 3, 5)]
    assert_bits(answered(made, good), [one for one in kept if isinstance(one, np.ndarray)])


def test_outputs_that_are_not_finite_are_an_error_of_their_motion_alone() -> None:
    made = system(g=lambda x, u, p: [np.sqrt(0.5 - x[0]), x[1], x[2]])
    large = Motion(np.linspace([0.0, 0.0], [2.0, 0.0], SAMPLES))
    small = Motion(np.zeros((SAMPLES, 2)))
    failed, fine = simulate_motions(made, [large, small])
    with pytest.raises(SimulationError) as alone:
        simulate_motion(made, large)
    assert isinstance(failed, SimulationError)
    assert rounded(failed) == rounded(alone.value)
    assert isinstance(fine, np.ndarray)


def test_error_of_a_function_for_all_lanes_is_found_in_its_own() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        if np.any(u[0] > 1.9):
            raise ValueError("too large a force")
        return [x[1], u[0] - x[0] - x[1], -x[2]]

    made = system(f, lambda x, u, p: list(x))
    assert made.most_at_once() > 1
    large = Motion(np.linspace([0.0, 0.0], [2.0, 0.0], SAMPLES))
    small = Motion(np.linspace([0.0, 0.0], [1.0, 0.0], SAMPLES))
    failed, fine = simulate_motions(made, [large, small])
    assert isinstance(failed, SimulationError)
    assert "too large a force" in str(failed)
    np.testing.assert_array_equal(fine, answered(made, [small])[0])


def test_error_of_a_function_of_one_state_alone_is_found_in_its_own() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        if u[0] > 1.9:
            raise ValueError("too large a force")
        return [x[1], u[0] - x[0] - x[1], -x[2]]

    made = system(f, lambda x, u, p: list(x))
    assert made.most_at_once() == ONE_BY_ONE
    large = Motion(np.linspace([0.0, 0.0], [2.0, 0.0], SAMPLES))
    small = Motion(np.linspace([0.0, 0.0], [1.0, 0.0], SAMPLES))
    failed, fine = simulate_motions(made, [large, small])
    assert isinstance(failed, SimulationError)
    assert "too large a force" in str(failed)
    np.testing.assert_array_equal(fine, answered(made, [small])[0])


def one_by_one(text: str, f: Function, g: Function = lambda x, u, p: list(x)) -> None:
    made = system(f, g)
    assert made.most_at_once() == ONE_BY_ONE
    remark = made.remarks[-1]
    assert text in remark
    assert "np.where(rate > 0, a, b)" in remark
    assert len(made.remarks) == 1
    assert_same(made, [motion(number, 20) for number in range(3)])


def test_branch_on_a_state_is_integrated_alone_and_remarked_with_its_line() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        push = 2.0 if x[0] > 0.0 else 1.0
        return [x[1], push * u[0] - x[0] - x[1], -x[2]]

    one_by_one("test_lanes.py, line", f)


def test_conversion_to_a_number_is_integrated_alone() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        return [x[1], float(u[0]) - x[0] - x[1], -x[2]]

    one_by_one("TypeError", f)


def test_sum_over_lanes_is_found_by_comparison() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        return [x[1], u[0] - np.sum(x), -x[2]]

    one_by_one("f gives", f)


def test_list_of_an_array_and_a_number_made_one_array_is_integrated_alone() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> FloatArray:
        return np.array([x[1], u[0] - x[0] - x[1], 0.0])

    one_by_one("test_lanes.py, line", f)


def test_rows_and_columns_the_wrong_way_round_are_refused() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> FloatArray:
        return np.stack([x[1], u[0] - x[0] - x[1], -x[2]], axis=-1)

    one_by_one("for 64 states at once", f)


def test_outputs_of_one_state_alone_are_remarked() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        return [x[1], u[0] - x[0] - x[1], -x[2]]

    one_by_one("g raised", f, lambda x, u, p: [max(x[0], 0.0), x[1], x[2]])


def test_what_differs_only_far_away_is_found_on_the_way() -> None:
    def f(x: FloatArray, u: FloatArray, p: Any) -> list[Any]:
        pulled = -5.0 if np.max(x[0]) > 50.0 else 0.0
        return [x[1], u[0] - 0.2 * x[1] + pulled * x[0], -x[2]]

    made = system(f, lambda x, u, p: list(x))
    far = State(np.array([45.0, 0.0, 0.0]), np.zeros(0), np.zeros(2))
    assert made.most_at_once() > 1
    motions = [Motion(np.full((SAMPLES, 2), 1.0 - k), far) for k in range(3)]
    assert_same(made, motions)
    assert made.most_at_once() == ONE_BY_ONE


def test_motions_at_once_have_room_whichever_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Inputs of 100 samples, with three outputs each, and three of them have room."""
    made, numbers = system(), list[int]()
    begin = FunctionSystem.begin_together

    def spied(made: FunctionSystem, systems: Any, *more: Any) -> Any:
        numbers.append(len(systems))
        return begin(made, systems, *more)

    monkeypatch.setattr(FunctionSystem, "begin_together", spied)
    monkeypatch.setattr(simulation, "MEMORY", 3 * 8 * 100 * (2 * 2 + 3))
    motions = [Motion(np.ones((samples, 2))) for samples in (10, 100, 100, 100)]
    answers = list(simulate_motions(made, motions))
    assert [len(answer) for answer in answers if isinstance(answer, np.ndarray)] == [
        11, 101, 101, 101,
    ]  # fmt: skip
    assert numbers == [3, 1]


@pytest.mark.parametrize("method", ["LSODA", "Radau", "BDF"])
def test_implicit_methods_integrate_one_by_one(method: str) -> None:
    made = system(solver=Solver(method))
    assert made.most_at_once() == 1
    assert made.remarks == ()
    assert_same(made, [motion(number, 10) for number in range(2)])
