"""One of several inputs moves, as in another kind of the mix, while the others rest."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.data.draws import Stream, draw_inputs
from slide_fmu.excitation.kinds import drawing_kind
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.excitation.one_at_a_time import OneAtATime
from tests.excitation.drawn import JOINTS, kind_of, motion
from tests.recipes import tiny_recipe

STEP = 0.01
TIME = STEP * np.arange(500)
FORCE = Signal("force", "N", -2.0, 2.0)
PUMP = Signal("pump", "1", 0.2, 1.0, start=0.3)
ANGLE = (
    Signal("x", "m", -0.5, 0.5, angle="cosine"),
    Signal("y", "m", -0.5, 0.5, angle="sine"),
)
SIGNALS = (FORCE, *ANGLE, PUMP)
SINE = kind_of("harmonic", angular_frequency=[5.0, 20.0])
HELD = kind_of("held_random")


def alone_as(other: object) -> OneAtATime:
    found = kind_of("one_at_a_time")
    assert isinstance(found, OneAtATime)
    return found.like(other)  # type: ignore[arg-type]


def test_one_input_moves_as_in_the_other_kind_and_the_others_rest() -> None:
    """Those at rest are at their start, or where the other kind would have them begin."""
    moved, at_start = Counter[str](), Counter[bool]()
    for seed in range(60):
        every = motion(SINE, SIGNALS, seed, time=TIME)
        inputs = motion(alone_as(SINE), SIGNALS, seed, time=TIME)
        axes = {"force": [0], "angle": [1, 2], "pump": [3]}
        (axis,) = [
            name for name, columns in axes.items() if np.ptp(inputs[:, columns], axis=0).max()
        ]
        moved[axis] += 1
        assert np.array_equal(inputs[:, axes[axis]], every[:, axes[axis]])
        for name, columns in axes.items():
            if name == axis:
                continue
            resting, first = inputs[:, columns], every[0, columns]
            assert np.ptp(resting, axis=0).max() == 0.0
            start = {"force": 0.0, "pump": 0.3}.get(name)
            if start is not None:
                at_start[resting[0, 0] == start] += 1
                assert resting[0, 0] in (start, first[0])
            else:
                assert np.array_equal(resting[0], first)  # zero and zero are no angle
    assert min(moved.values()) > 8
    assert set(moved) == {"force", "angle", "pump"}
    assert min(at_start[True], at_start[False]) > 15


def test_an_input_that_the_other_kind_moves_is_chosen() -> None:
    """The kind leaves some of them where they are; a motion of none would teach nothing."""
    moves = kind_of("point_to_point", single=1.0, keep=0.0, duration=[20.0, 20.0])
    for seed in range(20):
        inputs = motion(alone_as(moves), JOINTS, seed, time=TIME)
        assert np.count_nonzero(np.ptp(inputs, axis=0)) == 1


def test_amplitude_factor_is_that_of_the_other_kind() -> None:
    signals = (FORCE, Signal("other", "N", -2.0, 2.0))
    largest = max(
        np.abs(motion(alone_as(SINE), signals, seed, factor=1.5, time=TIME)).max()
        for seed in range(5)
    )
    assert largest == pytest.approx(3.0, rel=0.01)


def test_motion_bends_between_samples_if_that_of_the_other_kind_does() -> None:
    assert alone_as(SINE).bends
    assert not alone_as(HELD).bends


@pytest.mark.parametrize("signals", [(FORCE,), ANGLE])
def test_a_single_input_is_refused(signals: tuple[Signal, ...]) -> None:
    with pytest.raises(
        ValueError, match=r"kind = 'one_at_a_time' with the input .* two inputs or more"
    ):
        kind_of("one_at_a_time").check(signals)


def test_other_kinds_are_chosen_by_their_weights() -> None:
    usual = [
        kind_of("one_at_a_time"),
        SINE,
        HELD.model_copy(update={"weight": 3.0}),
        kind_of("one_at_a_time").model_copy(update={"weight": 50.0}),
    ]
    rng = np.random.default_rng(1)
    found = [drawing_kind(usual[0], usual, rng) for _ in range(400)]
    assert all(isinstance(kind, OneAtATime) for kind in found)
    assert sum(kind.bends for kind in found) / len(found) == pytest.approx(0.25, abs=0.06)
    assert drawing_kind(SINE, usual, rng) is SINE


def test_input_moves_as_the_kinds_that_are_named() -> None:
    alone = kind_of("one_at_a_time", moves_as="harmonic")
    usual, rng = [alone, SINE, HELD.model_copy(update={"weight": 50.0})], np.random.default_rng(1)
    assert SINE.kind == "harmonic"
    assert all(drawing_kind(alone, usual, rng).bends for _ in range(20))


def test_outer_inputs_of_a_loop_may_move_alone() -> None:
    loop = LoopRecipe(output="place", input="force", weight=1.0, stiffness=(10.0, 90.0))
    usual, rng = [kind_of("one_at_a_time"), SINE], np.random.default_rng(2)
    found = [drawing_kind(loop, usual, rng) for _ in range(200)]
    assert sum(isinstance(kind, OneAtATime) for kind in found) == pytest.approx(100, abs=30)
    assert all(kind.bends for kind in found)


def test_a_mix_draws_motions_of_one_input() -> None:
    kinds = (kind_of("steps", duration=[0.3, 0.5]), kind_of("one_at_a_time"))
    recipe = tiny_recipe().with_kinds(kinds)
    stream = Stream(0, 5, (1.0, 1.0), 300 * recipe.window.step)
    system = SimpleNamespace(inputs=SIGNALS)
    found = Counter[tuple[int, int]]()
    for index in range(40):
        drawn = draw_inputs(recipe, system, stream, index)  # type: ignore[arg-type]
        again = draw_inputs(recipe, system, stream, index)  # type: ignore[arg-type]
        assert np.array_equal(drawn.inputs, again.inputs)
        move = np.ptp(drawn.inputs, axis=0) > 0
        found[drawn.kind, int(move[[0, 1, 3]].sum())] += 1
    assert set(found) == {(0, 3), (1, 1)}
