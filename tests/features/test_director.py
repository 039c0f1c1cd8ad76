"""Directors of several angles among other inputs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray, Signal, period_of
from slide_fmu.features.base import BEFORE, FeatureOffer
from slide_fmu.features.director import ANGLE, COSINE, OTHER, SINE, Director, kinds_of
from tests.refusals import refused

FORCE = Signal("force", "N", -2.0, 4.0)
JOINT = Signal("joint", "rad", -1.0, 3.0)
COMPASS = Signal("compass", "deg", 0.0, 360.0)
PHASE = Signal("phase", "1", 0.0, 8.0, period=4.0)
PAIR = (Signal("c", "1", -1.0, 1.0, angle="cosine"), Signal("s", "1", -1.0, 1.0, angle="sine"))
MIXED = (FORCE, JOINT, *PAIR, COMPASS, PHASE)
FACTORS = {"joint": 1.0, "compass": math.pi / 180, "phase": math.pi / 2}
"""Rad per unit."""


def set_of(signals: tuple[Signal, ...], *names: str) -> Director:
    offered = FeatureOffer(signals, range_scaling(signals), 0.1, None)
    return Director.of_system(names or ("direction",), offered)


def test_angles_are_known_by_unit_period_or_meaning() -> None:
    assert kinds_of(MIXED) == (OTHER, ANGLE, COSINE, SINE, ANGLE, ANGLE)
    assert period_of(JOINT) == 2 * math.pi
    assert period_of(COMPASS) == 360.0
    assert (period_of(PHASE), period_of(FORCE)) == (4.0, None)
    with refused(ValueError, "expected a positive", "period -1.0"):
        Signal("phase", "1", 0.0, 8.0, period=-1.0)


@given(st.integers(0, 1000))
def test_every_angle_shows_its_motion_and_others_theirs(seed: int) -> None:
    """However often it goes round, in whatever unit."""
    rng, scaling = np.random.default_rng(seed), range_scaling(MIXED)
    values = np.cumsum(rng.uniform(-1, 1, (20, len(MIXED))), axis=0)
    angles = np.cumsum(rng.uniform(-3, 3, 20))
    values[:, 2], values[:, 3] = 0.7 * np.cos(angles), 0.7 * np.sin(angles)
    found = set_of(MIXED)
    signals = found.of(scaling.apply(values)[None])[0]
    true = [
        values[:, 1],
        angles,
        values[:, 4] * FACTORS["compass"],
        values[:, 5] * FACTORS["phase"],
    ]
    for k, angle in enumerate(true):
        turns = np.diff(angle)
        expected = {
            "direction": np.stack([np.cos(angle), np.sin(angle)], axis=1)[BEFORE:],
            "turn": turns[BEFORE - 1 :],
            "turn_change": np.diff(turns)[BEFORE - 2 :],
        }
        for name, value in expected.items():
            width = found.blocks[name] // len(true)
            part = list(found.indices((name,)))[width * k : width * (k + 1)]
            assert signals[:, part].squeeze() == pytest.approx(value, abs=1e-12), name
    force = scaling.apply(values)[:, 0]
    assert signals[:, found.indices(("others",))[0]] == pytest.approx(force[BEFORE:])
    moved = signals[:, found.indices(("other_changes",))[0]]
    assert moved == pytest.approx(np.diff(force)[BEFORE - 1 :])


def test_angle_that_is_wrapped_moves_on() -> None:
    """Beyond half a turn the short way is meant."""
    scaling = range_scaling((COMPASS,))
    values = np.array([[340.0], [350.0], [0.0], [10.0], [20.0]])
    signals = set_of((COMPASS,)).of(scaling.apply(values)[None])[0]
    assert signals[:, 2] == pytest.approx(math.radians(10))
    assert signals[:, 3] == pytest.approx(0, abs=1e-12)


def test_directions_are_scaled_where_an_angle_never_turns_far() -> None:
    near = Signal("lean", "rad", -0.01, 0.01)
    assert set_of((near, FORCE)).centred == {"direction"}
    assert set_of((near, FORCE)).bounded == {"others"}
    far = set_of((JOINT, *PAIR))
    assert (far.centred, far.bounded) == (set(), {"direction", "others"})


def test_inputs_without_an_angle_have_no_directions() -> None:
    with refused(ValueError, "expected an angle among", "1 inputs ['force']"):
        set_of((FORCE,))


def unit(n: int) -> Affine:
    return Affine(np.zeros(n), np.ones(n))


@pytest.mark.parametrize(
    "kinds", [(SINE, COSINE), (COSINE,), (COSINE, OTHER), (SINE,), (7,), (COSINE, COSINE, SINE)]
)
def test_parts_of_an_angle_that_stand_alone_are_refused(kinds: tuple[int, ...]) -> None:
    with refused(ValueError, "expected each to be 0"):
        Director(kinds, unit(len(kinds)))


@pytest.mark.parametrize(("kinds", "size"), [((OTHER, OTHER), 2), ((ANGLE,), 2)])
def test_directors_need_an_angle_and_a_scaling_of_all(kinds: tuple[int, ...], size: int) -> None:
    with refused(ValueError, "expected an angle", "all inputs"):
        Director(kinds, unit(size))


def rows(found: Director) -> FloatArray:
    return np.random.default_rng(0).normal(size=(1, 9, found.n_channels))


def test_names_follow_the_inputs() -> None:
    only = set_of((JOINT,))
    assert list(only.blocks) == ["direction", "turn", "turn_change"]
    assert only.of(rows(only)).shape == (1, 6, 4)
    with refused(ValueError, "no features named ['others']"):
        only.indices(("others",))
