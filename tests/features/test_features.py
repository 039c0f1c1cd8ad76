"""Features against formulas written out directly."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import COSINE, SINE, Director
from slide_fmu.features.drive_law import DRIVE_LAWS
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.network.state_space.cell import Roles
from tests.fmu.samples import random_chain
from tests.refusals import refused

STEP = 0.01
JOINTS = 4


def drawn(seed: int, channels: int, samples: int = 12) -> FloatArray:
    return np.random.default_rng(seed).normal(size=(2, samples, channels))


@given(st.integers(0, 1000), st.integers(1, 3), st.integers(0, 2))
def test_differences_are_those_of_numpy(seed: int, channels: int, order: int) -> None:
    inputs = drawn(seed, channels)
    found = Differences(channels, order).of(inputs)
    for k, part in enumerate(np.split(found, order + 1, axis=2)):
        assert np.array_equal(part, np.diff(inputs, k, axis=1)[:, BEFORE - k :])


def test_inputs_before_a_sequence_are_its_first() -> None:
    found = Differences(1, 2).along(np.array([[[5.0], [6.0], [8.0], [8.0]]]))[0]
    assert found.tolist() == [[5, 0, 0], [6, 1, 1], [8, 2, 1], [8, 0, -2]]


def test_differences_do_not_cancel() -> None:
    """Small changes of large inputs keep six digits: they are formed before rounding."""
    features = FeatureMap(
        Differences(1, 2), scaling=Affine.of_channels([0, 0, 0], [1, 1e-8, 1e-8])
    )
    sequence = 0.75 + 1e-8 * np.array([0.0, 1.0, 3.0, 6.0])
    found = features.along(sequence[None, :, None])[0]
    assert found.dtype == np.float32
    assert found[:, 1] == pytest.approx([0, 1, 2, 3], abs=1e-6)
    assert found[:, 2] == pytest.approx([0, 1, 1, 1], abs=1e-6)


CRANK = Director((COSINE, SINE), Affine(np.zeros(2), np.ones(2)))
"""One angle by its cosine and sine, as of a slider-crank."""


def directors(angles: FloatArray, lengths: FloatArray) -> FloatArray:
    return (lengths * np.stack([np.cos(angles), np.sin(angles)])).T[None]


@given(st.integers(0, 1000))
def test_director_shows_the_motion_of_its_angle(seed: int) -> None:
    """However often it goes round, whatever its length."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-3, 3, 40)
    angles, ones = np.cumsum(turns), np.ones(40)
    found = CRANK.of(directors(angles, rng.uniform(0.1, 9, 40)))[0]
    assert found[:, :2] == pytest.approx(directors(angles, ones)[0, BEFORE:], abs=1e-12)
    assert found[:, 2] == pytest.approx(turns[BEFORE:], abs=1e-12)
    assert found[:, 3] == pytest.approx(np.diff(turns)[BEFORE - 1 :], abs=1e-12)


def test_half_a_turn_is_positive() -> None:
    """In (-pi, pi]; a director without length has the angle 0."""
    sequence = np.array([[[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, 0.0]]])
    assert CRANK.along(sequence)[0, :, 2].tolist() == [0, math.pi, math.pi, 0]


SPLINE = DRIVE_LAWS["quadratic_b_spline"]


def motion_of(chain: SerialChain, seed: int = 0) -> ChainMotion:
    rng = np.random.default_rng(seed)
    n = chain.n_joints
    return ChainMotion(chain, SPLINE, rng.normal(size=n), rng.uniform(0.5, 2, n), STEP)


CHAIN = dataclasses.replace(random_chain(JOINTS, 3), prismatic=np.array([0.0, 0, 1, 0]))
MOTION = motion_of(CHAIN)


def signals(found: FloatArray, name: str, motion: ChainMotion = MOTION) -> FloatArray:
    return np.asarray(found[..., list(motion.indices((name,)))])


def test_a_chain_at_rest_weighs_on_its_base() -> None:
    found = MOTION.along(np.full((1, 1, JOINTS), 0.3))[0, 0]
    angles = MOTION.middle + 0.3 * MOTION.half_range
    first = CHAIN.base_inertia(angles)[1:4]
    weight = CHAIN.masses.sum() * CHAIN.gravity
    assert signals(found, "wrench") == pytest.approx([*weight, *np.cross(first, CHAIN.gravity)])
    for name in ("wrench_change", "rates", "turned_wrench_change", "turned_momentum"):
        assert signals(found, name) == pytest.approx(0, abs=1e-9), name


@given(st.integers(0, 1000))
def test_chain_motion_is_that_of_the_spline(seed: int) -> None:
    """Angles are means of two set points; rates and accelerations their differences."""
    inputs = drawn(seed, JOINTS)
    found, points = MOTION.of(inputs), MOTION.middle + MOTION.half_range * inputs
    angles = (points[:, 1:] + points[:, :-1])[:, 1:] / 2
    rates = np.diff(points, axis=1)[:, 1:] / STEP
    wrench = CHAIN.base_wrench(angles, rates, np.diff(points, 2, axis=1) / STEP**2)
    newest, change = angles[:, 1:], np.diff(wrench, axis=1)
    expected = {
        "wrench": wrench[:, 1:],
        "wrench_change": change,
        "position": CHAIN.tool_position(newest),
        "rates": rates[:, 1:],
        "frame": np.stack([np.cos(newest[..., 0]), np.sin(newest[..., 0])], axis=-1),
    }
    for name, value in expected.items():
        assert signals(found, name) == pytest.approx(value, rel=1e-9, abs=1e-6), name


def turn_about_z(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def test_turned_signals_are_those_of_the_base_in_turned_axes() -> None:
    inputs = drawn(1, JOINTS)[:1]
    found, points = MOTION.of(inputs)[0], MOTION.middle + MOTION.half_range * inputs[0]
    for k, row in enumerate(found):
        at = k + BEFORE
        angles = (points[at] + points[at - 1]) / 2
        back = turn_about_z(angles[0]).T
        momentum = CHAIN.base_momentum(angles, (points[at] - points[at - 1]) / STEP)
        inertia = CHAIN.base_inertia(angles)[1:]
        xx, yy, zz, xy, xz, yz = inertia[3:]
        tensor = back @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ back.T
        entries = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        change = signals(row, "wrench_change").reshape(2, 3)
        expected = {
            "turned_wrench_change": (change @ back.T).ravel(),
            "turned_inertia": [*(back @ inertia[:3]), *entries],
            "turned_momentum": (momentum.reshape(2, 3) @ back.T).ravel(),
        }
        for name, value in expected.items():
            assert signals(row, name) == pytest.approx(value, rel=1e-9), name


def test_turned_signals_do_not_know_the_direction() -> None:
    """With upright gravity all that changes with the first joint is where the chain points."""
    upright = dataclasses.replace(CHAIN, gravity=np.array([0.0, 0.0, -9.81]))
    motion, inputs = motion_of(upright), drawn(2, JOINTS)
    turned = inputs + np.array([0.8, 0, 0, 0])
    one, other = motion.of(inputs), motion.of(turned)
    for name in ("turned_wrench_change", "turned_inertia", "turned_momentum", "rates"):
        assert signals(other, name) == pytest.approx(signals(one, name), rel=1e-9, abs=1e-9), name
    back = turn_about_z(0.8 * motion.half_range[0])
    expected = signals(one, "position") @ back.T
    assert signals(other, "position") == pytest.approx(expected, rel=1e-9)
    assert np.max(np.abs(signals(other, "wrench") - signals(one, "wrench"))) > 1


def test_motion_has_constant_acceleration_in_every_step() -> None:
    """One joint: its angle moves by the mean of the rates at begin and end of each step."""
    chain = dataclasses.replace(
        random_chain(1, 0),
        prismatic=np.zeros(1),
        theta=np.zeros(1),
        steps=np.array([[1.0, 0.0, 0.0]]),
        tool=np.zeros(3),
    )
    motion = motion_of(chain)
    found = motion.of(0.3 * drawn(4, 1)[:1])[0]
    position, rates = signals(found, "position", motion), signals(found, "rates", motion)[:, 0]
    angles = np.unwrap(np.arctan2(position[:, 1], position[:, 0]))
    assert np.diff(angles) == pytest.approx(STEP * (rates[1:] + rates[:-1]) / 2, abs=1e-12)


def test_a_map_picks_centres_and_scales() -> None:
    features = Differences(2, 1)
    picked = FeatureMap(features, (3, 0), Affine.of_channels([0.5, 1.0], [2.0, 4.0]))
    inputs = drawn(5, 2)
    signals_of = features.along(inputs)
    expected = np.stack([(signals_of[..., 3] - 0.5) / 2, (signals_of[..., 0] - 1) / 4], axis=-1)
    assert (picked.n_channels, picked.n_signals) == (2, 2)
    assert picked.along(inputs) == pytest.approx(expected, rel=1e-6)


def test_signals_have_names() -> None:
    assert Differences(2, 2).indices(("second_changes", "inputs")) == (4, 5, 0, 1)
    assert CRANK.indices(("turn_change", "direction")) == (3, 0, 1)
    assert MOTION.n_signals == 38 + JOINTS
    assert set(MOTION.blocks) >= MOTION.centred
    with refused(ValueError, "expected some of", "named ['rate']"):
        MOTION.indices(("rates", "rate"))


def test_highest_role_is_that_of_all_parts() -> None:
    assert Roles((0, 3), (1,), turn=(5, 4)).highest() == 5
    assert Roles((), ()).highest() == -1


UNIT = Affine(np.zeros(2), np.ones(2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((),), "at least one, each from 0 to 2"),
        (((0, 3),), r"chosen features \(0, 3\)"),
        (((-1,),), "from 0 to 2"),
        (((0,), UNIT), "scaling of 2 features; expected 1, the number of chosen"),
    ],
)
def test_maps_that_do_not_fit_are_refused(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FeatureMap(Differences(1, 2), *arguments)  # type: ignore[arg-type]


def test_sets_that_do_not_fit_are_refused() -> None:
    for n_channels, order in ((1, 3), (1, -1), (0, 0)):
        with pytest.raises(ValueError, match=f"{n_channels} inputs with differences = {order}"):
            Differences(n_channels, order)
    two, four = np.ones(2), np.ones(JOINTS)
    with refused(ValueError, "4 joints with", "2 inputs"):
        ChainMotion(CHAIN, SPLINE, two, four, STEP)
    with refused(ValueError, "chain of 4 joints"):
        ChainMotion(CHAIN, SPLINE, four, two, STEP)
    with refused(ValueError, "is not finite"):
        ChainMotion(CHAIN, SPLINE, four, math.nan * four, STEP)
    for step in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match=f"step {step} s"):
            ChainMotion(CHAIN, SPLINE, four, four, step)
