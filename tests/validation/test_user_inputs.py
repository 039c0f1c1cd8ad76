"""Inputs as users set them keep their ranges and limits, and act at their own times."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.data.draws import TEST, Stream, draw_inputs
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System
from slide_fmu.validation.task import UNSEEN_SEED, Task
from slide_fmu.validation.user_channels import Channel, channels_of
from slide_fmu.validation.user_inputs import (
    OF_INPUTS,
    OF_MOTIONS,
    SINES,
    Drawing,
    UserInput,
    name_with_ranges,
    simulated_kinds,
    user_kinds,
)
from slide_fmu.validation.waveforms import HeldLevels, RepeatedMoves, StoppedTone, Tone, Triangle
from tests.progress import silent
from tests.recipes import tiny_state_space_recipe
from tests.validation.lag import LAG, lag_recipe, lag_surrogate

STEP = 0.02
TIME = STEP * np.arange(1500)

FREQUENCIES, TIMES = (1.0, 60.0), (0.02, 2.0)
FORCE = Channel((Signal("force", "N", -300.0, 1000.0),), -300.0, 1000.0, 0.0, FREQUENCIES, TIMES)
HEATED = Channel((Signal("heat", "K", 280.0, 320.0),), 280.0, 320.0, 290.0, FREQUENCIES, TIMES)
JOINT = Channel(
    (Signal("joint", "rad", 0.1234567, 2.5),), 0.1234567, 2.5, 0.5, FREQUENCIES, TIMES, 1.4, 5.7
)
COSINE, SINE = (
    Signal(f"{part}_of", "1", -2.0, 2.0, hold="first_order", angle=part)
    for part in ("cosine", "sine")
)
ANGLE = Channel((COSINE, SINE), -math.inf, math.inf, 0.0, FREQUENCIES, TIMES, 8.0, 20.0)


@pytest.mark.parametrize(
    ("channel", "kinds"),
    [(FORCE, OF_INPUTS), (HEATED, OF_INPUTS), (JOINT, OF_MOTIONS), (ANGLE, OF_MOTIONS)],
    ids=["force", "heat", "joint", "angle"],
)
def test_inputs_keep_their_ranges_and_the_limits_of_motions(
    channel: Channel, kinds: dict[str, Drawing]
) -> None:
    for drawing in kinds.values():
        for seed in range(20):
            values = drawing(channel, np.random.default_rng(seed))(TIME)
            assert channel.low - 1e-9 <= values.min() < values.max() <= channel.high + 1e-9
            if channel.speed is not None and channel.acceleration is not None:
                most = channel.speed * STEP, channel.acceleration * STEP**2
                for order, limit in enumerate(most, start=1):
                    assert np.abs(np.diff(values, order)).max() <= limit * (1 + 1e-6)


def test_switches_reach_both_limits() -> None:
    made = OF_INPUTS["switches between the limits"](FORCE, np.random.default_rng(0))
    assert set(made(TIME)) == {-300.0, 1000.0}


@pytest.mark.parametrize(
    "kind", ["steps", "switches between the limits", "a slow sine that stops, then a release"]
)
def test_held_inputs_jump_where_an_importer_sets_them(kind: str) -> None:
    """At multiples of the sample step; others at any time."""
    times = STEP / 10 * np.arange(200_000)
    for grid in (STEP, None):
        channel, jumps = dataclasses.replace(FORCE, grid=grid), []
        for seed in range(8):
            values = OF_INPUTS[kind](channel, np.random.default_rng(seed))(times)
            jumps += (1 + np.flatnonzero(np.abs(np.diff(values)) > 60)).tolist()
        assert len(jumps) > 3
        assert all(jump % 10 == 0 for jump in jumps) == (grid is not None)


def test_angles_are_given_by_cosine_and_sine_of_their_length() -> None:
    tone = OF_MOTIONS[SINES](ANGLE, np.random.default_rng(0))
    inputs = UserInput((ANGLE,), (tone,))(TIME)
    np.testing.assert_allclose(np.hypot(*inputs.T), 2.0)


def test_a_stopped_tone_stays_and_is_then_released() -> None:
    tone = Tone(0.0, 2.0, 3.0, 0.4)
    found = StoppedTone(tone, 1.0, 2.0, 0.25)(np.array([0.5, 1.0, 1.7, 2.0, 9.0]))
    stopped = 2 * np.sin(3.4)
    assert found == pytest.approx([2 * np.sin(1.9), stopped, stopped, 0.25, 0.25])


def test_names_say_frequencies_and_amplitudes_with_their_units() -> None:
    slow, fast = (Tone(350.0, size, 2 * math.pi * hz, 0.0) for size, hz in ((40, 0.5), (200, 2)))
    assert name_with_ranges(SINES, [FORCE], [[slow], [fast]]) == (
        "a sine of 0.5 to 2 Hz with an amplitude of 40 to 200 N in each input"
    )
    stopped = StoppedTone(slow, 1.0, 2.0, 0.0)
    assert name_with_ranges("a slow sine that stops, then a release", [FORCE], [[stopped]]) == (
        "a slow sine of 0.5 Hz with an amplitude of 40 N that stops, then a release"
    )
    triangle = Triangle(0.0, 2.0, 2 * math.pi, 0.0)
    assert name_with_ranges("a slow triangle", [ANGLE], [[triangle]]).endswith(
        "of 1 Hz with an amplitude of 1 rad"
    )
    warm = Tone(300.0, 10.0, 2 * math.pi, 0.0)
    assert name_with_ranges(SINES, [FORCE, HEATED], [[slow, warm]]) == (
        "a sine of 0.5 to 1 Hz with an amplitude of 3.1 to 25 % of each range in each input"
    )


def test_names_say_how_long_levels_last_and_how_fast_axes_move() -> None:
    levels = HeldLevels((0.0, 1.0), (0.03, 1.234))
    assert name_with_ranges("steps", [FORCE], [[levels]]) == "steps every 0.03 to 1.2 s"
    moves = RepeatedMoves(0.0, 1.0, 1.4, 5.7, 0.1)
    assert (
        name_with_ranges("moves and rests", [JOINT], [[moves]])
        == "moves and rests at up to 1.4 rad/s"
    )
    pair = name_with_ranges("moves and rests", [JOINT, FORCE], [[moves, moves]])
    assert pair == "moves and rests"  # of different units


def test_truth_of_inputs_that_jump_is_that_at_their_own_times(tmp_path: Path) -> None:
    """A lag under a held input: an importer at h sees a jump late, the reference does not."""
    recipe = lag_recipe(tmp_path, "zero_order")
    surrogate = lag_surrogate(recipe, "zero_order")
    case = case_of(recipe)
    kinds = user_kinds(surrogate, case, Task(UNSEEN_SEED), 2)
    motions = simulated_kinds(surrogate, case, kinds, silent)
    names, alone = [named.inputs for named in motions], [k for k in OF_INPUTS if k != SINES]
    assert len(names) == len(alone)
    assert all(one.startswith(kind[:6]) for one, kind in zip(names, alone, strict=True))
    assert all(len(each) == 2 for each in motions.values())
    (steps, _) = next(each for named, each in motions.items() if named.inputs[:5] == "steps")
    assert steps.grid == pytest.approx(0.0625 / 8)
    fine = steps.grid / 64
    middles = fine * (np.arange((len(steps.truth) - 1) * 64.0) + 0.5)
    pole = np.exp(-fine / LAG)
    exact = lfilter([1 - pole], [1, -pole], steps.course(middles)[:, 0])[63::64]
    later = steps.truth[1:, 0][len(exact) // 2 :]
    assert np.abs(later - exact[len(exact) // 2 :]).max() < 0.05 * np.ptp(exact)
    others = [kind.label.inputs for kind in user_kinds(surrogate, case, Task(7), 1)]
    assert not set(names) & set(others)


class Driven(System):
    """A system of signals alone."""

    def __init__(self, inputs: tuple[Signal, ...]) -> None:
        self.step, self.inputs, self.outputs = STEP, inputs, ()

    def simulate(self, inputs: FloatArray) -> FloatArray:
        raise NotImplementedError


def recipe_of(*kinds: dict[str, object]) -> Recipe:
    return tiny_state_space_recipe(
        data={"excitation": [{"weight": 1.0, **kind} for kind in kinds]}
    )


def test_limits_of_motions_are_the_largest_that_a_kind_declares() -> None:
    ramps = [
        {"kind": "speed_ramps", "speed": speed, "acceleration": acceleration}
        for speed, acceleration in ((8.0, 20.0), (2.0, 60.0))
    ]
    (angle,) = channels_of(recipe_of(*ramps), Driven((COSINE, SINE)), 1.0)
    assert (angle.speed, angle.acceleration, angle.unit) == (8.0, 60.0, "rad")
    joints = tuple(Signal(f"q{k}", "rad", -1.0, 1.0, hold="first_order") for k in (1, 2))
    moves = {"kind": "point_to_point", "speed": [1.0, 2.0], "acceleration": [5.0, 6.0]}
    found = channels_of(recipe_of(moves, {"kind": "point_to_point"}), Driven(joints), 1.0)
    assert [(one.speed, one.acceleration) for one in found] == [(1.0, 5.0), (2.0, 6.0)]


def test_limits_that_no_kind_declares_are_measured() -> None:
    recipe = recipe_of({"kind": "harmonic", "angular_frequency": [2.0, 5.0]})
    system = Driven((COSINE, SINE))
    (angle,) = channels_of(recipe, system, 1.0)
    assert angle.frequencies == (0.5 * math.pi, 5.0)
    assert angle.speed is not None
    assert angle.acceleration is not None
    assert 2.0 < angle.speed <= 5.0 * math.pi
    assert angle.acceleration <= 25.0 * math.pi
    stream = Stream(TEST, recipe.data.seed, (1.0, 1.0), recipe.data.duration)
    inputs = draw_inputs(recipe, system, stream, 0).inputs
    turned = np.abs(np.diff(np.unwrap(np.arctan2(inputs[:, 1], inputs[:, 0]))))
    assert turned.max() / recipe.window.step <= angle.speed


def test_inputs_that_may_jump_have_no_limits() -> None:
    recipe = tiny_state_space_recipe()
    (force,) = channels_of(recipe, case_of(recipe).system, 1.0)
    assert (force.speed, force.acceleration) == (None, None)
    assert force.frequencies[1] < math.pi / recipe.window.step
