"""Motions keep their limits, are smooth, and are what their names say."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.point_to_point import Moves
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import RecipeError
from tests.excitation.drawn import HIGH, JOINTS, LOW, STEP, TIME, kind_of, motion
from tests.recipes import tiny_state_space_recipe
from tests.refusals import refused
from tests.strategies import point_to_point_tables

DIRECTOR = (Signal("cosine", "1", -1.0, 1.0), Signal("sine", "1", -1.0, 1.0))
SPEED, ACCELERATION = (1.4, 1.3, 2.1, 4.0), (8.0, 10.0, 12.0, 20.0)
REALISTIC: dict[str, Any] = {
    "duration": [0.6, 2.0],
    "ramp": [0.15, 0.5],
    "speed": SPEED,
    "acceleration": ACCELERATION,
    "keep": 0.3,
    "single": 0.1,
    "dwell": 0.4,
}
RAMPS: dict[str, Any] = {"speed": 8.0, "acceleration": 20.0}


def rotation(
    seed: int, factor: float = 1.0, time: FloatArray = TIME, **extra: object
) -> FloatArray:
    """The angle, from its cosine and sine, shape (N,)."""
    kind = kind_of("speed_ramps", **{**RAMPS, **extra})
    cosine, sine = motion(kind, DIRECTOR, seed, factor, time).T
    assert cosine**2 + sine**2 == pytest.approx(np.ones(len(time)), abs=1e-14)
    return np.unwrap(np.arctan2(sine, cosine))


def speeds(positions: FloatArray) -> FloatArray:
    return np.diff(positions, axis=0) / STEP


def accelerations(positions: FloatArray) -> FloatArray:
    return np.diff(positions, n=2, axis=0) / STEP**2


@pytest.mark.parametrize(
    ("kind", "signals"),
    [
        (kind_of("speed_ramps", **RAMPS, noise=0.02), DIRECTOR),
        (kind_of("point_to_point"), JOINTS),
        (kind_of("point_to_point", **REALISTIC), JOINTS),
    ],
)
def test_motions_are_reproducible_and_differ_between_seeds(
    kind: Any, signals: tuple[Signal, ...]
) -> None:
    first = motion(kind, signals, 1)
    assert first.shape == (len(TIME), len(signals))
    assert np.array_equal(first, motion(kind, signals, 1))
    assert np.all(first[0] != motion(kind, signals, 2)[0])
    assert motion(kind, signals, 1, time=TIME[:1]).shape == (1, len(signals))
    assert not np.array_equal(first, motion(kind, signals, 1, factor=1.5))


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.7])
def test_rotation_keeps_its_limits_and_has_continuous_speed(factor: float) -> None:
    fastest = 0.0
    for seed in range(10):
        angle = rotation(seed, factor)
        assert np.max(np.abs(speeds(angle))) <= 8.0 * factor * (1 + 1e-9)
        assert np.max(np.abs(accelerations(angle))) <= 20.0 * factor * (1 + 1e-6)
        fastest = max(fastest, float(np.max(np.abs(speeds(angle)))))
    assert fastest > 7.99 * factor  # the limit is reached, and held


def test_rotation_of_a_declared_pair_has_the_length_of_its_range() -> None:
    pair = (
        Signal("x", "m", -0.05, 0.05, angle="cosine"),
        Signal("y", "m", -0.05, 0.05, angle="sine"),
    )
    kind = kind_of("speed_ramps", **RAMPS)
    kind.check(pair)
    assert motion(kind, pair, 1) == pytest.approx(0.05 * motion(kind, DIRECTOR, 1), abs=1e-16)


def test_rotation_has_phases_of_constant_acceleration() -> None:
    """Between the samples where its acceleration changes, far from the limit."""
    lengths: list[int] = []
    steady, total = 0, 0
    kind = kind_of("speed_ramps", speed=1e5, acceleration=20.0, samples=[20, 30])
    for seed in range(30):
        angle = kind.angle(TIME, 1.0, np.random.default_rng(seed))
        edges = np.flatnonzero(np.abs(np.diff(accelerations(angle))) > 1e-3)
        ends = [b for a, b in pairwise(edges) if b - a > 1]  # a change shows in two differences
        lengths += [int(b - a) for a, b in pairwise(ends)]
        values = accelerations(angle)[ends]
        steady, total = steady + int(np.sum(np.abs(values) < 1e-3)), total + len(values)
    assert min(lengths) >= 20
    assert np.quantile(lengths, 0.85) <= 31  # two phases without acceleration are one
    assert steady / total == pytest.approx(0.09, abs=0.03)  # two such in a row count once


def test_rotations_start_anywhere_in_motion_and_within_a_phase() -> None:
    angles = [rotation(seed, time=TIME[:60], acceleration=5.0) for seed in range(200)]
    starts = np.array([np.angle(np.exp(1j * angle[0])) for angle in angles])
    first = np.array([speeds(angle)[0] for angle in angles])
    assert np.std(starts) == pytest.approx(np.pi / np.sqrt(3), rel=0.1)
    assert np.std(first) == pytest.approx(8 / np.sqrt(3), rel=0.1)
    assert min(first_change(angle) for angle in angles) < 5  # phases have at least 20 samples


def first_change(angle: FloatArray) -> int:
    return int(np.argmax(np.abs(np.diff(accelerations(angle))) > 1e-6))


def test_angle_is_the_exact_integral_where_speed_meets_its_limit() -> None:
    """Against the same motion on a grid a thousand times as fine."""
    from slide_fmu.excitation.speed_ramps import _integral, _speeds

    fine, acceleration = 1000, np.array([20.0, 20.0, -7.0, -20.0, 0.0])
    h = 0.1
    speed = _speeds(5.3, h * acceleration, 6.0, 0.0)
    found = _integral(speed, acceleration, h)
    many = np.repeat(acceleration, fine)
    finer = _speeds(5.3, h / fine * many, 6.0, 0.0)
    sums = h / fine * (0.5 * (finer[1:] + finer[:-1])).reshape(-1, fine).sum(axis=1)
    assert found == pytest.approx(sums, abs=1e-6)


@pytest.mark.parametrize("factor", [1.0, 1.7])
def test_rotation_comes_to_rest_at_the_limit_of_its_acceleration(factor: float) -> None:
    limit, resting, stops = 20.0 * factor, [], 0
    for seed in range(20):
        angle = rotation(seed, factor, rest=0.3)
        assert np.max(np.abs(accelerations(angle))) <= limit * (1 + 1e-6)
        still = np.abs(speeds(angle)) < 1e-9
        resting.append(np.mean(still))
        for begun in np.flatnonzero(still[1:] & ~still[:-1]) + 1:
            before = np.abs(speeds(angle)[max(begun - 4, 0) : begun])
            if len(before) == 4 and before[0] > 3.1 * STEP * limit:
                stops += 1
                assert -np.diff(before)[:2] == pytest.approx(STEP * limit, rel=1e-3)
    assert 0.1 < np.mean(resting) < 0.3
    assert stops > 10


def test_rotation_rests_again_and_again_for_whole_phases() -> None:
    angle = rotation(1, rest=0.5, samples=[60, 60])
    still = np.abs(speeds(angle)) < 1e-9
    edges = np.flatnonzero(np.diff(still.astype(int)))
    assert len(edges) > 20
    assert not np.any(np.abs(speeds(rotation(1, samples=[60, 60]))) < 1e-9)  # none without


def test_noise_comes_on_half_of_the_samples() -> None:
    for seed in range(10):
        clean = rotation(seed, time=TIME[:1201])
        extra = speeds(rotation(seed, time=TIME[:1201], noise=0.02) - clean)
        changed = np.abs(extra) > 1e-6
        assert np.mean(changed) == pytest.approx(0.5, abs=0.05)
        assert 0.155 < np.max(np.abs(extra)) <= 0.16 + 1e-9  # 2 % of 8 rad/s


def test_paper_motion_is_bang_bang_and_synchronous() -> None:
    """Every whole second all joints rest; half-way between, the speed is largest."""
    moves = kind_of("point_to_point").moves(JOINTS, 12.0, np.random.default_rng(3))
    found = moves.at(moves.start[1] + np.arange(0, 10 * 60 + 1) / 60)
    whole = found[::60]
    assert found[30::60] == pytest.approx(0.5 * (whole[1:] + whole[:-1]), abs=1e-12)
    quarter = 0.875 * whole[:-1] + 0.125 * whole[1:]
    assert found[15::60] == pytest.approx(quarter, abs=1e-12)
    curve = np.abs(accelerations(found[:31]))
    assert curve == pytest.approx(np.broadcast_to(4 * np.abs(whole[1] - whole[0]), curve.shape))


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_joints_keep_ranges_and_limits(factor: float) -> None:
    kind = kind_of("point_to_point", **REALISTIC)
    for seed in range(5):
        found = motion(kind, JOINTS, seed, factor)
        assert np.all((found >= LOW) & (found <= HIGH))
        assert np.all(np.max(np.abs(speeds(found)), axis=0) <= factor * np.array(SPEED) + 1e-9)
        limit = factor**2 * np.array(ACCELERATION)
        assert np.all(np.max(np.abs(accelerations(found)), axis=0) <= limit + 1e-6)


def test_limits_are_used_and_short_moves_keep_their_duration() -> None:
    kind = kind_of("point_to_point", **REALISTIC)
    moves = kind.moves(JOINTS, 2000.0, np.random.default_rng(0))
    way = np.abs(np.diff(moves.positions, axis=0))
    fastest = way / moves.duration[:, None] / (1 - moves.ramp[:, None])
    hardest = fastest / moves.ramp[:, None] / moves.duration[:, None]
    used = np.max(np.maximum(fastest / SPEED, hardest / ACCELERATION), axis=1)
    assert np.max(used) <= 1 + 1e-12
    stretched = used > 1 - 1e-9
    assert 0.05 < np.mean(stretched) < 0.95
    assert np.all((moves.duration[~stretched] >= 0.6) & (moves.duration[~stretched] <= 2.0))
    assert np.all(moves.duration >= 0.6)


def test_a_motion_at_a_factor_is_the_same_motion_as_many_times_as_fast() -> None:
    kind = kind_of("point_to_point", **REALISTIC)
    slow = motion(kind, JOINTS, 5, time=2 * TIME)
    assert motion(kind, JOINTS, 5, factor=2.0) == pytest.approx(slow, abs=1e-12)


def test_shares_of_moves_are_kept() -> None:
    kind = kind_of("point_to_point", **REALISTIC)
    moves = kind.moves(JOINTS, 6000.0, np.random.default_rng(1))
    resting = np.sum(np.diff(moves.positions, axis=0) == 0, axis=1)
    counts = np.bincount(resting, minlength=5) / len(resting)
    # 0.6 all move; 0.3 keep one to four of them, each as often; 0.1 single
    assert counts == pytest.approx([0.6, 0.075, 0.075, 0.175, 0.075], abs=0.02)
    dwells = moves.start[1:] - moves.start[:-1] - moves.duration[:-1]
    dwelt = dwells[dwells > 1e-9]
    assert len(dwelt) / len(dwells) == pytest.approx(0.4, abs=0.03)
    assert 0.1 <= np.min(dwelt) < 0.12
    assert 0.98 < np.max(dwelt) <= 1.0 + 1e-9


def test_targets_fill_their_reach() -> None:
    kind = kind_of("point_to_point", reach=0.5, keep=0.0)
    points = kind.moves(JOINTS, 3000.0, np.random.default_rng(0)).positions
    middle, half = 0.5 * (LOW + HIGH), 0.25 * (HIGH - LOW)
    assert np.max(np.abs(points - middle) / half, axis=0) == pytest.approx(np.ones(4), abs=0.01)
    assert np.std((points - middle) / half) == pytest.approx(1 / np.sqrt(3), rel=0.03)


def test_random_starts_are_anywhere_within_a_move() -> None:
    kind = kind_of("point_to_point", **REALISTIC)
    moves = [kind.moves(JOINTS, 1.0, np.random.default_rng(seed)) for seed in range(300)]
    phases = np.array([-one.start[0] / one.duration[0] for one in moves])
    assert np.mean(phases) == pytest.approx(0.5, abs=0.07)
    assert np.std(phases) == pytest.approx(1 / np.sqrt(12), rel=0.1)


@given(
    durations=st.lists(st.floats(0.05, 3.0), min_size=1, max_size=5),
    dwell=st.floats(0.0, 1.0),
    ramp=st.floats(0.05, 0.5),
    seed=st.integers(0, 1000),
)
def test_velocity_is_continuous(
    durations: list[float], dwell: float, ramp: float, seed: int
) -> None:
    """Differences of the speed are no larger than the largest acceleration allows."""
    count = len(durations)
    start = np.concatenate([[0.0], np.cumsum(np.array(durations) + dwell)[:-1]])
    positions = np.random.default_rng(seed).uniform(-1, 1, (count + 1, 2))
    moves = Moves(start, np.array(durations), np.full(count, ramp), positions)
    step = 1e-3
    found = moves.at(np.arange(0, start[-1] + durations[-1] + 0.2, step))
    way = np.abs(np.diff(positions, axis=0))
    largest = way / (ramp * (1 - ramp) * np.array(durations)[:, None] ** 2)
    jumps = np.abs(np.diff(found, n=2, axis=0)) / step
    assert np.all(jumps <= step * np.max(largest) + 1e-9)
    assert np.array_equal(found[0], positions[0])
    assert found[-1] == pytest.approx(positions[-1], abs=1e-12)


@given(table=point_to_point_tables(), factor=st.floats(0.2, 5), seed=st.integers(0, 1000))
def test_any_point_to_point_motion_keeps_ranges_and_limits(
    table: dict[str, Any], factor: float, seed: int
) -> None:
    kind = kind_of("point_to_point", **table)
    found = motion(kind, JOINTS, seed, factor, TIME[:600])
    assert np.all((found >= LOW) & (found <= HIGH))
    assert np.all(np.abs(speeds(found)) <= factor * np.array(kind.speed) + 1e-9)
    limit = factor**2 * np.array(kind.acceleration)
    assert np.all(np.abs(accelerations(found)) <= limit + 1e-8)


@given(
    limits=st.tuples(st.floats(0.1, 30), st.floats(0.1, 100)),
    samples=st.tuples(st.integers(1, 80), st.integers(1, 80)).map(sorted),
    rest=st.floats(0, 1),
    factor=st.floats(0.2, 5),
    seed=st.integers(0, 1000),
)
def test_any_rotation_keeps_its_limits(
    limits: tuple[float, float],
    samples: list[int],
    rest: float,
    factor: float,
    seed: int,
) -> None:
    speed, acceleration = limits
    kind = kind_of(
        "speed_ramps",
        speed=speed,
        acceleration=acceleration,
        samples=samples,
        rest=rest,
    )
    angle = kind.angle(TIME[:600], factor, np.random.default_rng(seed))
    assert np.max(np.abs(speeds(angle))) <= factor * speed * (1 + 1e-9) + 1e-9
    assert np.max(np.abs(accelerations(angle))) <= factor * acceleration * (1 + 1e-9) + 1e-6


@pytest.mark.parametrize(
    ("name", "extra", "signals", "message"),
    [
        ("speed_ramps", RAMPS, JOINTS, "for 4 inputs .*'q1'.*; expected two, the cosine and the"),
        ("speed_ramps", RAMPS, (Signal("q1", "rad", 0.0, 1.0),) * 2, "for 'q1' of range 0 "),
        (
            "speed_ramps",
            RAMPS,
            (DIRECTOR[0], Signal("sine", "1", -0.5, 1.0)),
            r"for 'sine' of range -0\.5 \.\. 1; expected -1 \.\. 1",
        ),
        (
            "point_to_point",
            {"speed": SPEED},
            JOINTS[:3],
            r"speed has 4 values; expected 3, one for each input \['q1', 'q2', 'q3'\]",
        ),
        (
            "point_to_point",
            {"acceleration": [1.0]},
            JOINTS,
            "acceleration has 1 values; expected 4",
        ),
    ],
)
def test_inputs_that_do_not_fit_are_refused(
    name: str, extra: dict[str, Any], signals: tuple[Signal, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        motion(kind_of(name, **extra), signals, 0)


def test_recipe_whose_excitation_does_not_fit_is_refused_at_once() -> None:
    kinds = [
        {"kind": "held_random", "weight": 1.0},
        {"kind": "speed_ramps", "weight": 1.0, **RAMPS},
    ]
    recipe = tiny_state_space_recipe(data={"excitation": kinds})
    with refused(RecipeError, "kind = 'speed_ramps'", "2nd [[data"):
        _ = case_of(recipe).system


@pytest.mark.parametrize(
    ("name", "extra", "key"),
    [
        ("speed_ramps", {"speed": 8.0}, "acceleration"),
        ("speed_ramps", {**RAMPS, "speed": 0.0}, "speed"),
        ("speed_ramps", {**RAMPS, "samples": [0, 5]}, "samples"),
        ("speed_ramps", {**RAMPS, "rest": 1.5}, "rest"),
        ("speed_ramps", {**RAMPS, "noise": -0.1}, "noise"),
        ("speed_ramps", {**RAMPS, "amplitude": [0.5, 1.0]}, "amplitude"),
        ("point_to_point", {"ramp": [0.2, 0.6]}, "ramp"),
        ("point_to_point", {"ramp": [0.0, 0.5]}, "ramp"),
        ("point_to_point", {"duration": [0.0, 1.0]}, "duration"),
        ("point_to_point", {"speed": [1.0, 0.0]}, "speed"),
        ("point_to_point", {"acceleration": [float("inf")]}, "acceleration"),
        ("point_to_point", {"reach": 1.2}, "reach"),
        ("vibration", {"angular_frequency": [0.0, 9.0], "acceleration": [1.0]}, "frequency"),
        ("vibration", {"angular_frequency": [5.0, 9.0], "acceleration": []}, "acceleration"),
        ("point_to_point", {"keep": 0.8, "single": 0.3}, r"keep = 0\.8, single = 0\.3"),
    ],
)
def test_values_that_make_no_sense_are_refused(
    name: str, extra: dict[str, object], key: str
) -> None:
    with pytest.raises(ValidationError, match=key):
        kind_of(name, **extra)
