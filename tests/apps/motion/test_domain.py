"""Moves stay in the surrogate's domain: slower ones are taken, or the task is refused."""

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
    MoveTask,
    choose,
    coordinates_of,
    earliest,
    inputs_of,
    largest,
    quietest,
    settled,
)
from slide_fmu.apps.motion.earliest_move import baselines
from slide_fmu.apps.motion.motion_report import motion_report, remark_on_moves
from slide_fmu.apps.motion.move import Move
from slide_fmu.apps.motion.solve import solve
from slide_fmu.network.state_space.network import StateSpace
from tests.bounded import random_bound
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
FREE = np.array([np.inf])


def crank_problem(tolerance: float = 2e-3) -> MoveProblem:
    released = slide.load(ROOT / "fmus" / "slider_crank" / "slider_crank.fmu")
    crank = replace(released, bound=None)  # the tests have domains of their own
    limits = Limits(-FREE, FREE, np.array([8.0]), np.array([20.0]), FREE)
    return MoveProblem(crank, np.zeros(1), np.full(1, 2.0), limits, tolerance)


def with_domain(problem: MoveProblem, slower: float = 1.4) -> MoveProblem:
    """The same problem for a surrogate that knows moves so many times slower than limits admit."""
    surrogate = problem.surrogate
    network = surrogate.network
    assert isinstance(network, StateSpace)
    response, _, known = baselines(replace(problem, slower=slower))
    scaled = surrogate.input_scaling.apply(response.inputs(known[0].motion))[None]
    bound = random_bound(network, 0)
    _, watched, _ = bound.statistics(scaled, network.stream(scaled).astype(np.float64))
    limits = 1.02 * watched[0].max(axis=0) + 1e-9
    little = {
        name: np.full_like(getattr(bound, name), 1e-6)
        for name in ("factors", "tolerances", "floors")
    }
    small = replace(bound, **little, limits=limits)
    return replace(problem, surrogate=replace(surrogate, bound=small))


def require_in_domain(problem: MoveProblem, move: Move) -> None:
    coordinates, surrogate = coordinates_of(problem.surrogate.inputs), problem.surrogate
    lead = np.tile(problem.start, (surrogate.window.n_in, 1))
    inputs = inputs_of(coordinates, np.concatenate([lead, move.motion]))
    rests = [surrogate.trust(np.tile(inputs[at], (9, 1))).novelty[-1] for at in (0, -1)]
    known = max(1, 1.05 * max(rests))
    assert surrogate.trust(inputs).novelty[len(lead) :].max() <= known
    assert problem.limits.kept(problem.start, move.motion, surrogate.window.step)


@pytest.mark.extended
def test_earliest_move_is_one_in_the_domain() -> None:
    problem = crank_problem()
    free, bounded = earliest(problem), earliest(with_domain(problem))
    require_in_domain(with_domain(problem), bounded.move)
    assert bounded.move.end > free.move.end
    # the domain is why: the free one leaves it
    surrogate = with_domain(problem).surrogate
    coordinates = coordinates_of(surrogate.inputs)
    inputs = inputs_of(coordinates, np.concatenate([np.zeros((128, 1)), free.move.motion]))
    assert not surrogate.trust(inputs).in_domain[128:].all()
    assert bounded.baselines[0].known < 1


@pytest.mark.extended
def test_moves_get_slower_where_all_that_are_as_fast_as_their_limits_leave_the_domain() -> None:
    problem = with_domain(crank_problem(), slower=2.4)
    found = earliest(problem)
    assert found.slower > 1
    require_in_domain(problem, found.move)
    assert found.move.trusted(settled, found.response, problem.tolerance) < np.inf


@pytest.mark.extended
def test_an_answer_tells_that_faster_moves_leave_the_domain(tmp_path: Path) -> None:
    told = {}
    for slower in (1.4, 2.4):
        problem = with_domain(crank_problem(), slower)
        fmu = slide.export_fmu(problem.surrogate, tmp_path / "crank.fmu")
        limits = {"speed": (8.0,), "acceleration": (20.0,)}
        table = {"kind": "earliest", "start": (0.0,), "goal": (2.0,), "tolerance": 2e-3}
        solved = solve(fmu, MoveTask.model_validate({**table, "limits": limits}))
        told[slower] = str(remark_on_moves(solved))
        assert told[slower] in motion_report(solved).summary
    assert "leave the domain of the surrogate, so they are no answer: not shaped" in told[1.4]
    assert "all of them begin with" in told[2.4]


def test_an_answer_that_is_a_baseline_is_said_to_be_one(tmp_path: Path) -> None:
    fmu = slide.export_fmu(crank_problem().surrogate, tmp_path / "crank.fmu")
    limits = {"speed": (8.0,), "acceleration": (20.0,)}
    table = {"kind": "earliest", "start": (0.0,), "goal": (2.0,), "tolerance": 2e-3}
    solved = solve(fmu, MoveTask.model_validate({**table, "limits": limits}))
    assert "No other move" not in str(remark_on_moves(solved))
    found = replace(solved.optimised, move=solved.optimised.baselines[0])
    assert "the answer is 'not shaped'" in str(remark_on_moves(replace(solved, optimised=found)))


def test_quietest_move_of_a_time_that_leaves_the_domain_is_refused() -> None:
    problem = with_domain(crank_problem())
    with refused(MotionError, "all moves of 0.6", "leave the domain", "more ti"):
        quietest(problem, 0.7)
    require_in_domain(problem, quietest(problem, 1.5).move)


@pytest.mark.extended
def test_best_candidate_is_one_in_the_domain() -> None:
    problem = with_domain(crank_problem())
    require_in_domain(problem, choose(problem, largest, MoveFamily(300, 3.0, 0)).move)


@pytest.mark.extended
def test_a_domain_without_any_move_is_named_as_the_reason() -> None:
    hard = with_domain(crank_problem(), slower=6.0)
    with refused(MotionError, "stays in the domain", "even 3 times slower"):
        earliest(hard)
    with refused(MotionError, "40 candidates leave", "the domain"):
        choose(hard, settled, MoveFamily(40, 1.0, 0))


def duffing_problem(start: float, limits_of_domain: float = 1.0) -> MoveProblem:
    """A force that jumps; the limits of the released domain are multiplied by a factor."""
    duffing = slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu")
    assert duffing.bound is not None
    bound = replace(duffing.bound, limits=limits_of_domain * duffing.bound.limits)
    limits = Limits(np.array([-1000.0]), np.array([1000.0]), FREE, FREE, FREE)
    surrogate = replace(duffing, bound=bound)
    return MoveProblem(surrogate, np.array([start]), np.array([600.0]), limits, 5e-3)


@pytest.mark.parametrize("kind", ["earliest", "quietest", "choose"])
def test_a_start_that_a_surrogate_does_not_know_is_refused(kind: str) -> None:
    problem = duffing_problem(-1000.0, 0.1)
    searches = {
        "earliest": lambda: earliest(problem),
        "quietest": lambda: quietest(problem, 0.6),
        "choose": lambda: choose(problem, settled, MoveFamily(10, 1.5, 0)),
    }
    with refused(MotionError, "[-1000.0] is outside", "start [-1000.0]"):
        searches[kind]()


def test_a_long_rest_that_no_training_had_belongs_to_the_domain() -> None:
    """Novelty compares means over time, so it is above 1 at rest far out."""
    problem = duffing_problem(-800.0, 0.8)
    assert problem.surrogate.trust(problem.start[None]).novelty[0] > 1
    require_in_domain(problem, earliest(problem).move)


def test_a_move_of_the_released_duffing_without_limits_ends_in_its_domain() -> None:
    duffing = slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu")
    limits = Limits(np.array([-1000.0]), np.array([1000.0]), FREE, FREE, FREE)
    problem = MoveProblem(duffing, np.array([-300.0]), np.array([900.0]), limits, 5e-3)
    found = earliest(problem)
    require_in_domain(problem, found.move)
    assert found.move.known == 1
