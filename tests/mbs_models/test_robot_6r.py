"""The robot on its socket against statics, other formulations, and its own derivatives."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from mbs_models.robot_6r.puma_560 import DAMPING, JOINTS, LIMITS, STIFFNESS
from mbs_models.robot_6r.robot_6r import Robot6R
from mbs_models.robot_6r.socket import FLANGE, Socket
from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.memory.modes import spectrum
from slide_fmu.systems.base import State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

SOCKETS = ("spring", "finite_element")
JOINT_COORDINATES = slice(FLANGE, FLANGE + JOINTS)


def moves(count: int, seed: int = 1, samples: int = 60) -> FloatArray:
    """Set points of fast moves between random poses: constant acceleration, then deceleration.

    Returns:
        shape (count * samples + 1, 6); the first row is the pose that the motion starts from.
    """
    poses = np.random.default_rng(seed).uniform(-LIMITS, LIMITS, (count + 1, JOINTS))
    s = np.arange(1, samples + 1) / samples
    share = np.where(s < 0.5, 2.0 * s**2, 1.0 - 2.0 * (1.0 - s) ** 2)[:, None]
    legs = [start + (end - start) * share for start, end in itertools.pairwise(poses)]
    return np.vstack([poses[:1], *legs])


def response(system: Robot6R, set_points: FloatArray) -> FloatArray:
    """Outputs from the static equilibrium at the first set point."""
    return simulate(system, set_points[1:], system.rest_state(set_points[0])).outputs


def error(found: FloatArray, reference: FloatArray) -> float:
    """RMS of the difference, of the reference's standard deviation."""
    spread = np.sqrt(np.mean(np.var(reference, axis=0)))
    return float(np.sqrt(np.mean((found - reference) ** 2)) / spread)


def moving_state(system: Robot6R, seed: int = 1) -> State:
    """A state in the middle of a move."""
    set_points = moves(1, seed)[:31]
    response(system, set_points)
    return system.get_state()


@pytest.mark.parametrize("kind", SOCKETS)
def test_static_equilibrium_stays(kind: str) -> None:
    system = Robot6R(socket=kind)
    pose = 0.9 * np.random.default_rng(5).uniform(-LIMITS, LIMITS)
    rest = system.rest_state(pose)
    outputs = simulate(system, np.tile(pose, (60, 1)), rest).outputs
    # the fast one neglects what is of the third order in angles up to 0.003 rad
    assert np.max(np.abs(outputs - outputs[0])) < {"spring": 1e-8, "finite_element": 1e-11}[kind]
    assert np.max(np.abs(outputs[0])) > 1e-4
    assert np.max(np.abs(system.get_state().coordinates - rest.coordinates)) < 1e-8


def test_sag_is_the_weight_over_the_stiffness() -> None:
    system, pose = Robot6R(), np.array([0.3, -0.5, 0.4, 0.2, 0.6, -0.1])
    rest, still = system.rest_state(pose), np.zeros(JOINTS)
    joints = rest.coordinates[JOINT_COORDINATES]
    socket = Socket.read().symmetric()
    load = (socket.weight @ system.chain.gravity)[:FLANGE]
    load += system.chain.base_wrench(joints, still, still)
    place = np.linalg.solve(socket.stiffness[:FLANGE, :FLANGE], load)
    # the flange turns by 0.003 rad and the load with it: linear to that share
    assert np.linalg.norm(rest.coordinates[:FLANGE] - place) < 0.01 * np.linalg.norm(place)
    sagged = pose - system.chain.joint_torques(joints, still, still) / STIFFNESS
    assert joints == pytest.approx(sagged, abs=0.01 * np.max(np.abs(sagged - pose)))


def test_deviation_is_what_the_flange_does_to_the_tool() -> None:
    system = Robot6R(tool_length=0.1, rotation=True)
    state = moving_state(system)
    flange, joints = state.coordinates[:FLANGE], state.coordinates[JOINT_COORDINATES]
    turn = Rotation.from_euler("XYZ", flange[3:])
    rigid = system.chain.tool_position(joints)
    found = system.output()
    assert found[:3] == pytest.approx(flange[:3] + turn.apply(rigid) - rigid, abs=1e-15)
    assert found[3:] == pytest.approx(turn.as_rotvec(), abs=1e-14)
    points = system.points(state)
    assert points.shape == (9, 3)
    assert points[0] == pytest.approx([0.0, 0.0, -0.3])
    assert points[1] == pytest.approx(flange[:3])
    assert points[-1] - rigid == pytest.approx(found[:3], abs=1e-15)
    assert np.linalg.norm(points[-1] - points[-2]) == pytest.approx(0.1)


def test_spring_agrees_with_finite_elements() -> None:
    set_points = moves(2)
    spring, elements = (response(Robot6R(socket=kind), set_points) for kind in SOCKETS)
    assert error(spring[60:], elements[60:]) < 3e-4


@pytest.mark.extended
@pytest.mark.parametrize("kind", SOCKETS)
def test_substeps_converge_with_the_second_order(kind: str) -> None:
    set_points = moves(1)
    fine, default, coarse, half = (
        response(Robot6R(socket=kind, substeps=n), set_points)[20:] for n in (64, 8, 3, 6)
    )
    assert error(default, fine) < 1.5e-3
    assert error(coarse, fine) < 8e-3
    assert 3.3 < error(coarse, fine) / error(half, fine) < 4.7


@pytest.mark.parametrize("kind", SOCKETS)
def test_linearization_is_the_answer_to_a_small_push(kind: str) -> None:
    system = Robot6R(socket=kind, substeps=32)
    pose = np.array([0.3, -0.5, 0.4, 0.2, 0.6, -0.1])
    rest = system.rest_state(pose)
    found = system.linearize(rest)
    n = len(found.mass)
    assert found.constraints.shape == (0, n)
    rates = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(found.mass, np.hstack([found.stiffness, found.damping]))],
        ]
    )
    push = 1e-4 * np.linalg.eigh(found.mass)[1][:, -1]
    drives = np.zeros(JOINTS)
    pushed = State(rest.coordinates, np.concatenate([push, drives]), rest.last_input)
    steady = simulate(system, np.tile(pose, (30, 1)), rest).outputs
    moved = simulate(system, np.tile(pose, (30, 1)), pushed).outputs
    end = expm(rates * 30 * system.step) @ np.concatenate([np.zeros(n), push])
    for samples in (5, 30):
        change = expm(rates * samples * system.step) @ np.concatenate([np.zeros(n), push])
        system.set_state(
            State(
                rest.coordinates + np.concatenate([change[:n], drives]),
                rest.velocities,
                rest.last_input,
            )
        )
        expected = system.output() - steady[0]
        answer = moved[samples] - steady[samples]
        assert np.linalg.norm(answer - expected) < 3e-3 * np.max(np.abs(moved - steady))
    assert np.linalg.norm(end[:n]) < np.linalg.norm(push)


def test_linearization_of_a_moving_arm_is_that_of_its_torques() -> None:
    system = Robot6R()
    state = moving_state(system)
    state.velocities[:FLANGE] = 0.0
    found = system.linearize(state)
    q, dq = state.coordinates[JOINT_COORDINATES], state.velocities[JOINT_COORDINATES]
    arm, still = system.chain, np.zeros(JOINTS)
    mass = [arm.joint_torques(q, still, e) - arm.joint_torques(q, still, still) for e in np.eye(6)]
    joints = (JOINT_COORDINATES, JOINT_COORDINATES)
    assert found.mass[joints] == pytest.approx(np.array(mass), abs=1e-6)
    eps = 1e-4
    ahead, behind = (
        np.array([arm.joint_torques(q, dq + s * e, still) for e in np.eye(6)]) for s in (eps, -eps)
    )
    damping = np.diag(DAMPING) + (ahead - behind).T / (2.0 * eps)
    assert found.damping[joints] == pytest.approx(damping, abs=1e-4 * np.max(DAMPING))
    total = np.sum(arm.masses) + Socket.read().mass[0, 0]
    assert found.mass[0, 0] == pytest.approx(total, rel=1e-3)


def test_robot_forgets_within_a_second() -> None:
    """The slowest motion forgets 99 % within a second, as the paper's truncation needs."""
    system = Robot6R()
    for seed in range(5):
        state = system.random_state(np.random.default_rng(seed))
        slowest = spectrum(system.linearize(state), 1e-2).modes[0]
        assert 0.3 < slowest.decay_time < 1.2


@pytest.mark.parametrize("kind", SOCKETS)
def test_continuing_and_pickling_equal_one_go(kind: str) -> None:
    set_points = moves(1, 3)
    system, other = Robot6R(socket=kind), Robot6R(socket=kind)
    start = system.rest_state(set_points[0])
    whole = simulate(system, set_points[1:], start).outputs
    assert np.array_equal(simulate(other, set_points[1:], start).outputs, whole)
    simulate(system, set_points[1:21], start)
    copy = pickle.loads(pickle.dumps(system))
    middle = system.get_state()
    on = np.array([system.advance(row) for row in set_points[21:]])
    assert np.array_equal(on, whole[21:])
    again = np.array([copy.advance(row) for row in set_points[21:]])
    assert error(again, on) < 1e-5
    assert error(simulate(other, set_points[21:], middle).outputs[1:], on) < 1e-5


def test_random_states_fill_their_range() -> None:
    system, first = Robot6R(), np.full(JOINTS, 0.2)
    states = [system.random_state(np.random.default_rng(seed)) for seed in range(40)]
    poses = np.array([state.coordinates[-JOINTS:] for state in states])
    assert np.all(np.abs(poses) <= LIMITS)
    assert np.all(np.max(np.abs(poses), axis=0) > 0.8 * LIMITS)
    assert all(np.array_equal(s.last_input, s.coordinates[-JOINTS:]) for s in states)
    assert not any(state.velocities.any() for state in states)
    near = system.random_state(np.random.default_rng(0), first)
    assert near.coordinates[-JOINTS:] == pytest.approx(first, abs=0.0)
    rest = system.rest_state(first)
    off = np.abs(near.coordinates - rest.coordinates)
    assert np.all(off[JOINT_COORDINATES] < 0.006)
    assert 1e-5 < np.max(off[:3]) < 5e-3


def test_signals_are_those_of_the_robot() -> None:
    system = Robot6R(rotation=True, deviation_limit=0.02, step=0.02)
    assert [signal.name for signal in system.inputs] == [f"joint_{i}" for i in range(1, 7)]
    assert [signal.high for signal in system.inputs] == pytest.approx(LIMITS)
    names = [f"{what}_{axis}" for what in ("deviation", "rotation") for axis in "xyz"]
    assert [signal.name for signal in system.outputs] == names
    assert [signal.unit for signal in system.outputs] == ["m"] * 3 + ["rad"] * 3
    assert {signal.high for signal in system.outputs[:3]} == {0.02}
    assert (system.step, hold_of(system.inputs)) == (0.02, "first_order")
    assert Robot6R().chain.tool == pytest.approx(np.zeros(3))


def test_authors_gains_are_stable_and_different() -> None:
    set_points = moves(1, 4)
    ours, theirs = (response(Robot6R(authors_gains=flag), set_points) for flag in (False, True))
    assert 1e-3 < error(theirs, ours) < 1.0


def test_impossible_motions_are_an_error_and_not_the_end() -> None:
    system = Robot6R()
    rest = system.rest_state(np.zeros(JOINTS))
    with pytest.raises(SimulationError):
        simulate(system, np.tile([1e9, -1e9, 1e9, 0.0, 0.0, 0.0], (5, 1)), rest)
    assert np.isfinite(simulate(system, np.zeros((5, JOINTS)), rest).outputs).all()
