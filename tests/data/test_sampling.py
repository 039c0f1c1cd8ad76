"""Every trajectory has a seed of its own and can be made again alone."""

from __future__ import annotations

import dataclasses
from itertools import combinations

import numpy as np
import pytest

from slide_fmu.data.draws import (
    PROBE,
    STABILITY,
    STREAMS,
    TEST,
    Draw,
    Stream,
    draw,
    simulate_draw,
    split_stream,
)
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import OF_BOUND
from slide_fmu.recipe.recipe import SPLITS as EVERY
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe

COUNT = 6
SPLITS = tuple(split for split in EVERY if split not in OF_BOUND)
RECIPE = tiny_state_space_recipe(
    data={
        **dict.fromkeys(SPLITS, COUNT),
        "beyond_factor": (1.25, 2.5),
        "excitation": [
            {"kind": "held_random", "weight": 1.0},
            {"kind": "harmonic", "weight": 1.0, "angular_frequency": (5.0, 60.0)},
        ],
    },
    estimator={
        **ESTIMATOR,
        "beyond": True,
        "expert": {"in_range": 0.5, "amplitude_factor": (1.5, 3.0)},
    },
)
SYSTEM = case_of(RECIPE).system


def drawn(split: str, index: int) -> Draw:
    return draw(RECIPE, SYSTEM, split_stream(RECIPE, split, index), index)


def unseen(index: int, seed: int) -> Draw:
    return draw(RECIPE, SYSTEM, Stream(TEST, seed, (1.0, 1.0), 2.0), index)


def test_a_trajectory_made_again_alone_is_the_same() -> None:
    """Whatever was drawn and simulated before it, on this system or on another."""
    order = [(split, index) for split in SPLITS for index in (0, 3, 5)]
    first = {key: simulate_draw(SYSTEM, drawn(*key)) for key in order}
    for key in reversed(order):
        again = simulate_draw(SYSTEM, drawn(*key))
        alone = simulate_draw(case_of(RECIPE).system, drawn(*key))
        for other in (again, alone):
            assert np.array_equal(other.inputs, first[key].inputs)
            assert np.array_equal(other.outputs, first[key].outputs)


def test_no_two_trajectories_share_inputs_or_states() -> None:
    draws = [drawn(split, index) for split in SPLITS for index in range(COUNT)]
    seeds = (RECIPE.data.seed, RECIPE.data.seed + 1)
    draws += [unseen(index, seed) for index in range(COUNT) for seed in seeds]
    assert len({one.inputs.tobytes() for one in draws}) == len(draws)
    assert len({one.initial.coordinates.tobytes() for one in draws}) == len(draws)
    held = [set(one.inputs.ravel().tolist()) for one in draws if one.kind == 0]
    assert len(held) > 10
    assert all(a.isdisjoint(b) for a, b in combinations(held, 2))  # nor parts of them


def test_every_purpose_has_a_stream_of_its_own() -> None:
    """Released data are drawn again by these numbers: new splits come after them."""
    assert STREAMS.keys() == set(EVERY)
    assert [*STREAMS.values(), TEST, PROBE, STABILITY] == [0, 1, 2, 3, 7, 9, 10, 11, 12, 4, 5, 6]


@pytest.mark.parametrize("split", [split for split in SPLITS if split != "beyond"])
def test_trajectories_beyond_the_range_change_no_others(split: str) -> None:
    data = RECIPE.data.model_copy(update={"beyond": 0, "beyond_factor": (1.0, 3.0)})
    without = RECIPE.model_copy(update={"data": data})
    for index in range(COUNT):
        there = draw(without, SYSTEM, split_stream(without, split, index), index)
        assert np.array_equal(there.inputs, drawn(split, index).inputs)
        assert np.array_equal(there.initial.coordinates, drawn(split, index).initial.coordinates)


def test_only_estimator_and_beyond_leave_the_range() -> None:
    limit = SYSTEM.inputs[0].high
    for split in SPLITS:
        factors = [drawn(split, index).factor for index in range(COUNT)]
        if split.startswith("estimator"):
            assert factors[::2] == [1.0, 1.0, 1.0]
            assert all(1.5 <= factor <= 3.0 for factor in factors[1::2])
            assert len(set(factors[1::2])) == 3
        elif split == "beyond":
            assert all(1.25 <= factor <= 2.5 for factor in factors)
            assert len(set(factors)) == COUNT
        else:
            assert set(factors) == {1.0}
        for index, factor in enumerate(factors):
            largest = np.max(np.abs(drawn(split, index).inputs))
            assert 0.5 * factor * limit < largest <= factor * limit


@pytest.mark.parametrize("in_range", [0.0, 0.1, 0.25, 0.6, 0.7, 0.9, 1.0])
def test_those_in_range_and_beyond_take_turns(in_range: float) -> None:
    """Any number of the first ones holds about the share that was asked for."""
    recipe = tiny_recipe(
        data={"estimator": 1, "estimator_validation": 1},
        estimator={**ESTIMATOR, "beyond": True, "expert": {"in_range": in_range}},
    ).estimator
    assert recipe is not None
    beyond = np.cumsum([recipe.draws_beyond(index) for index in range(1000)])
    shares = (1.0 - in_range) * np.arange(1, 1001)
    assert np.all(np.abs(beyond - shares) < 1.0)
    assert beyond[-1] == round(shares[-1])
    assert recipe.draws_beyond(0) == (in_range == 0.0)


THREE_KINDS = tiny_state_space_recipe(
    data={
        "excitation": [
            {"kind": "held_random", "weight": 0.98},
            {"kind": "harmonic", "weight": 0.01, "angular_frequency": (5.0, 60.0)},
            {"kind": "rest", "weight": 0.01, "duration": (0.1, 0.5)},
        ],
    },
)


def kinds_of(stream: Stream, count: int) -> list[int]:
    return [draw(THREE_KINDS, SYSTEM, stream, index).kind for index in range(count)]


@pytest.mark.parametrize("number", [STREAMS["bound"], STREAMS["calibration"], TEST])
def test_kinds_that_are_promised_take_turns_whatever_their_weights(number: int) -> None:
    """Orders of the rounds differ, or sequences of parameters would go with the kinds."""
    kinds = kinds_of(Stream(number, 8, (1.0, 1.0), 2.0), 60)
    rounds = [tuple(kinds[first : first + 3]) for first in range(0, 60, 3)]
    assert all(sorted(one) == [0, 1, 2] for one in rounds)
    assert len(set(rounds)) > 3


def test_kinds_of_the_training_come_by_their_weights() -> None:
    kinds = kinds_of(Stream(STREAMS["train"], 8, (1.0, 1.0), 2.0), 60)
    assert kinds.count(0) > 54


def test_any_kind_takes_the_place_of_one_that_fails_again_and_again() -> None:
    stream = Stream(TEST, 8, (1.0, 1.0), 2.0)
    rare = next(index for index in range(3) if stream.kind_of(index, 3, 0) == 2)
    attempts = [draw(THREE_KINDS, SYSTEM, stream, rare, n) for n in range(20)]
    assert [one.kind for one in attempts[:2]] == [2, 2]
    assert not np.array_equal(attempts[0].inputs, attempts[1].inputs)
    assert [one.kind for one in attempts[2:]].count(0) > 12


def test_burn_in_is_simulated_and_left_out() -> None:
    one = drawn("train", 0)
    trajectory = simulate_draw(SYSTEM, one)
    assert (one.burn_in, len(one.inputs)) == (16, 16 + 128)
    assert np.array_equal(trajectory.inputs, one.inputs[16:])
    assert trajectory.outputs.shape == (129, 1)
    whole = simulate_draw(SYSTEM, dataclasses.replace(one, burn_in=0))
    assert np.array_equal(whole.outputs[16:], trajectory.outputs)
    assert whole.outputs[0] == one.initial.coordinates
