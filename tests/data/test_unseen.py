"""Unseen motions: drawn as validations draw them, and simulated with the reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data import draws
from slide_fmu.data.draws import ATTEMPTS, TEST, Stream, draw
from slide_fmu.data.unseen import known_or_simulated, unseen_motions
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate, simulate_motion
from tests.own_records import RECIPE, write_record
from tests.recipes import tiny_recipe
from tests.refusals import refused

STREAM = Stream(TEST, 3, (1.0, 1.0), 1.0)


def test_motions_are_the_draws_with_what_the_reference_does_on_them() -> None:
    recipe, calls = tiny_recipe(), []
    motions = list(
        unseen_motions(recipe, case_of(recipe).reference, STREAM, 2, lambda *a: calls.append(a))
    )
    system = case_of(recipe).reference
    for index, motion in enumerate(motions):
        drawn = draw(recipe, system, STREAM, index)
        np.testing.assert_array_equal(motion.inputs, drawn.inputs)
        outputs = simulate(system, drawn.inputs, drawn.initial).outputs
        np.testing.assert_array_equal(motion.outputs, outputs)
        assert (motion.burn_in, motion.kind) == (16, 0)
        assert (motion.first(5), motion.first(40)) == (17, 40)
    assert calls == [(0, 2), (1, 2), (2, 2)]


def test_motion_that_cannot_be_simulated_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = tiny_recipe()
    failing = iter([True, False])

    def sometimes(*arguments: object) -> object:
        if next(failing):
            raise SimulationError("no convergence")
        return simulate_motion(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(draws, "simulate_motion", sometimes)
    (motion,) = unseen_motions(recipe, case_of(recipe).reference, STREAM, 1, lambda *_: None)
    second = draw(recipe, case_of(recipe).reference, STREAM, 0, attempt=1)
    np.testing.assert_array_equal(motion.inputs, second.inputs)


def test_another_start_is_drawn_where_one_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """A model may fail while it looks for a start."""
    recipe, failing = tiny_recipe(), [True]
    system = type(case_of(recipe).reference)
    random_state = system.random_state

    def sometimes(self: object, *arguments: object) -> object:
        if failing:
            failing.pop()
            raise SimulationError("no equilibrium")
        return random_state(self, *arguments)

    monkeypatch.setattr(system, "random_state", sometimes)
    (motion,) = unseen_motions(recipe, case_of(recipe).reference, STREAM, 1, lambda *_: None)
    second = draw(recipe, case_of(recipe).reference, STREAM, 0, attempt=1)
    np.testing.assert_array_equal(motion.inputs, second.inputs)


def test_system_that_always_fails_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def never(*_: object) -> object:
        calls.append(1)
        raise SimulationError("no convergence")

    monkeypatch.setattr(draws, "simulate_motion", never)
    with refused(SimulationError, "5 motions in", "the kinds", "no convergence"):
        list(
            unseen_motions(
                tiny_recipe(), case_of(tiny_recipe()).reference, STREAM, 1, lambda *_: None
            )
        )
    assert len(calls) == ATTEMPTS


def test_motions_of_a_record_are_its_blocks_that_nothing_learnt_from(tmp_path: Path) -> None:
    path = write_record(tmp_path / "bench.csv", 3000)
    text = RECIPE.replace("bench.csv", str(path))
    lengths = {"data": {"duration": 4.0, "burn_in": 2.4}}
    recipe = parse_open_recipe(text, "bench.toml").with_found(lengths, "bench.toml").guess
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    motions = known_or_simulated(source, recipe, list)
    motion = motions[-1]  # the block that ends the record
    measured = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(motion.outputs[-1, 0], measured[-1, 2], rtol=1e-6)
    for motion in motions:
        assert (motion.burn_in, motion.kind) == (recipe.window.n_in, 0)
        assert len(motion.outputs) == len(motion.inputs) + 1
