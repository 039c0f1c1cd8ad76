"""Moves that the released surrogates choose keep their limits, and stand still where they say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.motion import (
    Limits,
    MotionError,
    MoveFamily,
    MoveProblem,
    MoveResponses,
    MoveTask,
    choose,
    coordinates_of,
    earliest,
    inputs_of,
    largest,
    quietest,
    residual,
    settled,
)
from slide_fmu.apps.motion.costs import Cost
from slide_fmu.apps.motion.earliest_move import OptimisedMove
from slide_fmu.apps.motion.move import Move
from slide_fmu.apps.motion.solve import solve, write_set_points
from slide_fmu.core.signals import FloatArray
from tests.fmu.samples import sum_surrogate
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
SPEED = np.array([1.431, 1.292, 2.129, 3.979, 4.206, 3.979])
ACCELERATION = np.array([5.7, 5.2, 8.5, 15.9, 16.8, 15.9])


def released(name: str) -> slide.Surrogate:
    return slide.load(ROOT / f"fmus/{name}/{name}.fmu")


def robot_problem(seed: int = 3, tolerance: float = 1e-4) -> MoveProblem:
    surrogate = released("robot_6r")
    low, high = (np.array([getattr(s, end) for s in surrogate.inputs]) for end in ("low", "high"))
    start, goal = np.random.default_rng(seed).uniform(0.6 * low, 0.6 * high, (2, 6))
    limits = Limits(low, high, SPEED, ACCELERATION, np.full(6, np.inf))
    return MoveProblem(surrogate, start, goal, limits, tolerance)


def force_problem(goal: float, tolerance: float, start: float = 0.0) -> MoveProblem:
    surrogate = released("duffing")
    free = np.array([np.inf])
    limits = Limits(np.array([-1000.0]), np.array([1000.0]), free, free, free)
    return MoveProblem(surrogate, np.array([start]), np.array([goal]), limits, tolerance)


def streamed(problem: MoveProblem, move: Move) -> FloatArray:
    """What the surrogate says step by step, with a long rest before, about rest at the goal."""
    signals = coordinates_of(problem.surrogate.inputs)
    before = np.tile(problem.start, (300, 1))
    inputs = inputs_of(signals, np.concatenate([before, move.motion]))
    rest = problem.surrogate.predict_newest(inputs_of(signals, problem.goal[None]))[0]
    return problem.surrogate.predict_newest(inputs)[300:] - rest


@pytest.fixture(scope="module")
def of_robot() -> OptimisedMove:
    return earliest(robot_problem())


@pytest.mark.extended
def test_earliest_move_of_the_robot_is_earlier_than_any_shaper_and_keeps_all_limits(
    of_robot: OptimisedMove,
) -> None:
    problem, found = robot_problem(), of_robot
    move, step = found.move, problem.surrogate.window.step
    assert move.name == "optimised"
    assert problem.limits.kept(problem.start, move.motion, step)
    np.testing.assert_allclose(
        move.motion[move.end :], np.tile(problem.goal, (len(move.motion) - move.end, 1))
    )
    away = np.linalg.norm(streamed(problem, move), axis=1)
    assert away[move.end :].max() <= problem.tolerance
    assert found.baselines[0].name == "not shaped"
    mine = cost_of(problem, settled, move)
    assert all(cost_of(problem, settled, other) > mine for other in found.baselines)


@pytest.mark.extended
def test_joints_with_time_laws_of_their_own_are_earlier_than_on_a_line(
    of_robot: OptimisedMove,
) -> None:
    problem = robot_problem()
    own, line = of_robot, earliest(replace(problem, straight=True))
    assert own.move.end < line.move.end
    assert problem.limits.kept(problem.start, own.move.motion, problem.surrogate.window.step)
    shares = [
        (found.move.motion - problem.start) / (problem.goal - problem.start)
        for found in (own, line)
    ]
    np.testing.assert_allclose(shares[1], shares[1][:, :1] + np.zeros(6), atol=1e-9)
    assert np.ptp(shares[0], axis=1).max() > 0.01
    assert np.abs(streamed(problem, own.move)[own.move.end :]).max() <= problem.tolerance


@pytest.mark.extended
def test_a_joint_that_need_not_move_stays() -> None:
    problem = robot_problem()
    goal = np.where(np.arange(6) == 3, problem.start, problem.goal)
    move = earliest(replace(problem, goal=goal)).move
    np.testing.assert_array_equal(move.motion[:, 3], problem.start[3])


@pytest.mark.extended
def test_predictions_of_moves_are_those_of_the_streamed_surrogate() -> None:
    problem = robot_problem(seed=8)
    for move in earliest(problem).baselines[:2]:
        np.testing.assert_allclose(move.outputs, streamed(problem, move), atol=2e-6)


def test_force_on_the_duffing_settles_without_ringing() -> None:
    problem = force_problem(600.0, 2e-3)
    found = earliest(problem)
    assert found.move.name == "optimised"
    away = np.abs(streamed(problem, found.move)[:, 0])
    assert away[found.move.end :].max() <= 2e-3
    assert np.abs(found.move.motion).max() <= 1000.0
    mine, *others = (cost_of(problem, settled, move) for move in (found.move, *found.baselines))
    assert mine < 0.5 * min(others)


def test_crank_turns_as_one_angle() -> None:
    surrogate = released("slider_crank")
    (angle,) = coordinates_of(surrogate.inputs)
    assert angle.unit == "rad"
    free = np.array([np.inf])
    limits = Limits(-free, free, np.array([8.0]), np.array([20.0]), free)
    problem = MoveProblem(surrogate, np.full(1, 0.5), np.full(1, 7.5), limits, 1e-3)
    found = earliest(problem)
    assert found.move.motion[-1, 0] == 7.5  # more than a turn
    inputs = inputs_of((angle,), found.move.motion)
    np.testing.assert_allclose(np.hypot(*inputs.T), 1.0)
    away = np.linalg.norm(streamed(problem, found.move), axis=1)
    assert away[found.move.end :].max() <= 1e-3


def test_a_tolerance_below_what_is_known_is_refused_in_words() -> None:
    with refused(MotionError, "tolerance 1e-06 m; no move", "tried leaves"):
        earliest(robot_problem(tolerance=1e-6))


@pytest.mark.extended
def test_quietest_move_rings_less_than_all_others_of_its_time() -> None:
    problem = robot_problem()
    found = quietest(problem, 1.35)
    names = [move.name for move in found.baselines]
    assert names[0] == "not shaped"
    assert len(names) > 1
    left = {
        move.name: np.linalg.norm(move.outputs[move.end :], axis=1).max()
        for move in (found.move, *found.baselines)
    }
    assert min(left, key=lambda name: left[name]) == found.move.name
    assert left[found.move.name] < 0.05 * left["not shaped"]
    assert all(found.response.time[move.end] < 1.35 + 0.02 for move in found.baselines)


def test_a_time_below_what_the_limits_need_is_refused() -> None:
    with refused(MotionError, "expected at least 1.1", "0.3 s"):
        quietest(robot_problem(), 0.3)


def cost_of(problem: MoveProblem, cost: Cost, move: Move) -> float:
    ends, time = np.array([move.end]), problem.surrogate.window.step * np.arange(len(move.motion))
    told = MoveResponses(move.outputs[None], move.margin[None], ends, time, problem.tolerance)
    return float(cost(told)[0])


@pytest.mark.extended
@pytest.mark.parametrize("cost", [settled, residual, largest])
def test_choice_is_the_least_cost_of_candidates_and_baselines(cost: Cost) -> None:
    problem = robot_problem()
    few = choose(problem, cost, MoveFamily(40, 1.5, 0)).move
    many = choose(problem, cost, MoveFamily(400, 1.5, 0))
    least = cost_of(problem, cost, many.move)
    assert least <= cost_of(problem, cost, few)
    assert all(least <= cost_of(problem, cost, move) for move in many.baselines)
    assert problem.limits.kept(problem.start, many.move.motion, problem.surrogate.window.step)


@pytest.mark.extended
def test_the_same_seed_chooses_the_same_move() -> None:
    problem = robot_problem()
    one, same, other = (
        choose(problem, largest, MoveFamily(64, 1.5, seed)).move for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.motion, same.motion)
    assert not np.array_equal(one.motion[: other.end], other.motion[: other.end])


def test_a_move_without_a_way_is_refused() -> None:
    with refused(MotionError, "both [5.0]"):
        force_problem(5.0, 1e-3, start=5.0)


def test_costs_of_a_move_that_never_settles() -> None:
    outputs, time = np.zeros((2, 10, 1)), 0.1 * np.arange(1, 11)
    outputs[0, 6] = 1.0
    outputs[1, 9] = 1.0
    told = MoveResponses(outputs, np.zeros((2, 10)), np.array([3, 3]), time, 0.5)
    np.testing.assert_allclose(settled(told), [0.8, np.inf])
    np.testing.assert_allclose(residual(told), [1.0, 1.0])
    with_margin = MoveResponses(outputs, np.full((2, 10), 0.25), np.array([8, 3]), time, 0.5)
    np.testing.assert_allclose(residual(with_margin), [0.25, 1.25])
    np.testing.assert_allclose(settled(with_margin), [0.9, np.inf])


def test_networks_without_a_state_are_refused() -> None:
    """A sum of the window has no response to a whole record."""
    plain, free = sum_surrogate(), np.array([np.inf])
    limits = Limits(-free, free, free, free, free)
    with refused(MotionError, "expected one of the family", "family 'state_space'"):
        earliest(MoveProblem(plain, np.zeros(1), np.ones(1), limits, 1.0))


@pytest.mark.parametrize("name", ["duffing", "linear", "robot_6r", "slider_crank"])
def test_written_set_points_give_the_predicted_outputs_in_an_importer(
    name: str, tmp_path: Path
) -> None:
    fmu = ROOT / f"fmus/{name}/{name}.fmu"
    goals = {"duffing": [400.0], "linear": [500.0], "slider_crank": [2.5]}
    goal = goals.get(name, [0.3, 0.4, -0.2, 0.1, 0.2, 0.3])
    wide = {"speed": [3.0] * len(goal), "acceleration": [10.0] * len(goal)}
    limits = {} if goal[0] > 100 else wide
    tolerance = {"duffing": 2e-2, "linear": 5e-2, "slider_crank": 5e-2}.get(name, 1e-3)
    start = [0.5 if name == "slider_crank" else 0.0] * len(goal)  # in the crank's domain
    table = {"kind": "earliest", "start": start, "goal": goal, "tolerance": tolerance}
    task = MoveTask.model_validate({**table, "limits": limits})
    solved = solve(fmu, task)
    place = tmp_path / "set_points.csv"
    assert write_set_points(solved, place) is None
    rows = np.loadtxt(place, delimiter=",", skiprows=1)
    # the last set points stay until the response has faded
    step, count = solved.surrogate.window.step, solved.optimised.response.count
    still = np.tile(rows[-1, 1:], (count, 1))
    inputs = np.concatenate([rows[:, 1:], still])[: count + 1]
    time = step * np.arange(len(inputs))
    outputs = slide.simulate(fmu, time, inputs)
    move = solved.optimised.move
    expected = move.outputs + solved.optimised.response.rest
    at = np.round(solved.optimised.response.output_time / step).astype(int)
    inside = at < len(time)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(outputs[at[inside]], expected[inside], atol=2e-3 * scale)


def test_moves_between_the_ends_of_the_range_stay_in_it() -> None:
    problem = force_problem(1000.0, 2e-3, start=-1000.0)
    # its domain does not reach so far
    found = earliest(replace(problem, surrogate=replace(problem.surrogate, bound=None)))
    assert np.abs(found.move.motion).max() <= 1000.0 * (1 + 1e-6)


@pytest.mark.parametrize(("start", "goal", "tolerance"), [(-350.0, 1000.0, 2e-3), (0, 900, 3e-3)])
def test_earliest_move_settles_no_later_than_any_baseline(
    start: float, goal: float, tolerance: float
) -> None:
    problem = force_problem(goal, tolerance, start=start)
    found = earliest(problem)
    mine = cost_of(problem, settled, found.move)
    assert np.isfinite(mine)
    assert all(mine <= cost_of(problem, settled, move) for move in found.baselines)


def test_moves_that_take_too_many_samples_are_refused_at_once() -> None:
    problem = force_problem(900.0, 1e-3)
    one = np.array([0.001])
    slow = Limits(problem.limits.low, problem.limits.high, one, one * np.inf, one * np.inf)
    with refused(MotionError, "expected at most 5000: raise", "the limits"):
        earliest(MoveProblem(problem.surrogate, problem.start, problem.goal, slow, 1e-3))
