"""Inputs leave their ranges only where a recipe asks for that; what fails there ends no run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal, outside_of_range
from slide_fmu.data.draws import STABILITY, Stream, draw, draw_inputs, split_stream
from slide_fmu.data.failures import Failure, is_beyond, kept_failures, remark_on_beyond
from slide_fmu.data.generation import generate
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.recipe.recipe import SPLITS, Recipe, RecipeError
from slide_fmu.systems.base import RandomStates, State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate
from tests.data.failing_system import FailingSystem
from tests.progress import silent
from tests.recipes import ESTIMATOR, TINY, tiny_recipe, tiny_state_space_recipe, whole_recipe
from tests.refusals import refused
from tests.trajectories import read_split

OF_ESTIMATOR = "estimator", "estimator_validation"
RANGES = (-4.53, 9.36), (-0.66, 5.42)
"""Middle plus half of the width is more than the upper end, by rounding."""
COUNTS = {"train": 4, "validation": 2, "estimator": 6, "estimator_validation": 2}


def recipe(fail: float = 9.0, beyond: int = 0, **estimator: Any) -> Recipe:
    """A recipe of a system that fails above an input of so much, whose range ends at 1."""
    tables = tiny_state_space_recipe(
        data={**COUNTS, "beyond": beyond}, estimator={**ESTIMATOR, "expert": estimator}
    ).model_dump(mode="json")
    tables["system"].update(
        model="tests.data.failing_system:FailingSystem", parameters={"fail": fail}
    )
    tables["window"]["step"], tables["data"]["duration"] = 0.1, 6.0
    return whole_recipe(tables)


def values(path: Path, wanted: Recipe) -> dict[tuple[str, int], FloatArray]:
    """All inputs of a recipe's trajectories by split and index."""
    return {
        (split, index): row
        for split in SPLITS
        if wanted.count(split)
        for index, row in enumerate(read_split(wanted, path, split).inputs)
    }


def failures_of(wanted: Recipe, path: Path) -> list[Failure]:
    return kept_failures(case_of(wanted), path)


def test_an_estimator_stays_in_range_unless_it_is_asked_to_go_beyond() -> None:
    for wanted in (recipe(), recipe(amplitude_factor=(0.5, 1.0), in_range=0.0)):
        for split in OF_ESTIMATOR:
            assert all(split_stream(wanted, split, i).factors[1] == 1.0 for i in range(6))
    asked = tiny_recipe(data=COUNTS, estimator={**ESTIMATOR, "beyond": True})
    factors = [split_stream(asked, "estimator", i).factors for i in range(4)]
    assert factors == [(1.0, 1.0), (1.0, 3.0)] * 2
    assert Recipe.model_validate_json(asked.model_dump_json()) == asked


def test_a_factor_above_1_without_the_key_is_refused_with_the_remedy() -> None:
    text = TINY.replace("train = 4", "train = 4\nestimator = 2\nestimator_validation = 2")
    text += "\n[estimator.expert]\namplitude_factor = [1.0, 2.0]\n"
    with pytest.raises(RecipeError, match=r"= \[1\.0, 2\.0\] drives inputs") as caught:
        parse_recipe(text, "mine.toml")
    assert "add beyond = true to [estimator]" in str(caught.value)


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_every_draw_in_range_is_within_it_to_the_last_digit(low: float, high: float) -> None:
    tables = recipe().model_dump(mode="json")
    tables["data"]["excitation"] = [{"kind": "binary", "weight": 1.0, "duration": [0.2, 0.5]}]
    wanted, system = whole_recipe(tables), FailingSystem()
    system.inputs = (Signal("force", "N", low, high),)
    draws = [draw(wanted, system, split_stream(wanted, "train", i), i) for i in range(3)]
    raw = wanted.data.excitation[0].inputs(
        system.inputs, 0.1 * np.arange(60.0), 1.0, np.random.default_rng(0)
    )
    assert outside_of_range(system.inputs, raw)  # else there would be nothing to clip
    assert all(outside_of_range(system.inputs, drawn.inputs) is None for drawn in draws)


class Strict(FailingSystem, RandomStates):
    """Refuses to draw a state for an input outside of its range."""

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        assert first_input is not None
        if abs(first_input[0]) > 1.0:
            raise SimulationError("no state there")
        return State(first_input, np.empty(0), first_input)

    def begin(self, held_input: FloatArray) -> None: ...

    def rest_state(self, held_input: FloatArray) -> State:
        return State(held_input, np.empty(0), held_input)

    def set_state(self, state: State) -> None: ...

    def get_state(self) -> State:
        return State(np.zeros(1), np.empty(0), np.zeros(1))

    def output(self) -> FloatArray:
        return np.zeros(1)

    def advance(self, inputs: FloatArray) -> FloatArray:
        return inputs


def test_inputs_of_a_stability_test_ask_the_system_for_no_state() -> None:
    wanted, stream = recipe(), Stream(STABILITY, 1, (10.0, 10.0), 6.0)
    for index in range(5):
        outer = draw_inputs(wanted, Strict(), stream, index)
        assert outer.initial is None
        alone = draw(wanted, FailingSystem(), stream, index)
        np.testing.assert_array_equal(outer.inputs, alone.inputs)


def test_a_failure_names_the_input_that_is_outside_of_its_range() -> None:
    inputs = np.array([[0.5], [1.5], [-3.25], [0.0]])
    expected = r"input force = 1\.5 lies outside of its range -1\.\.1.*no solution at t = 0\.1 s"
    with pytest.raises(SimulationError, match=expected) as caught:
        simulate(FailingSystem(fail=1.0), inputs)
    assert caught.value.time == 0.1
    with refused(SimulationError, "no solution"):
        simulate(FailingSystem(fail=0.2), inputs[:1])


@pytest.mark.extended
@pytest.mark.parametrize("in_range", [0.5, 0.0])
def test_trajectories_beyond_that_fail_are_left_out_with_a_remark(
    in_range: float, tmp_path: Path
) -> None:
    """All of them where none is in range; a run never dies of it."""
    path = tmp_path / "failing" / "trajectories"
    wanted = asked(1.0, in_range)
    generate(case_of(wanted), path, None, silent)
    assert all(np.abs(row).max() <= 1.0 for row in values(path, wanted).values())
    failures = failures_of(wanted, path)
    assert failures
    assert all(is_beyond(wanted, failure.name) for failure in failures)
    remark = remark_on_beyond(case_of(wanted), path)
    assert remark is not None
    beyond = 3 + (4 if in_range else 8)
    assert remark.startswith(f"{beyond} of {beyond} trajectories beyond the ranges of the inputs")
    assert "data.beyond and estimator.beyond" in remark
    assert "lies outside of its range -1..1" in remark
    fine = asked(9.0, in_range)
    generate(case_of(fine), tmp_path / "fine" / "trajectories", None, silent)
    assert remark_on_beyond(case_of(fine), tmp_path / "fine" / "trajectories") is None
    largest = [
        np.abs(row).max() for key, row in values(tmp_path / "fine" / "trajectories", fine).items()
    ]
    assert sum(value > 1.0 for value in largest) == beyond


def asked(fail: float, in_range: float = 0.5) -> Recipe:
    """The recipe with inputs beyond the range, of the estimator and of the surrogate."""
    tables = recipe(fail, 3).model_dump(mode="json")
    own = {"amplitude_factor": [1.5, 3.0], "in_range": in_range}
    tables["estimator"]["beyond"] = True
    tables["estimator"]["expert"].update(own)
    tables["data"]["beyond_factor"] = [2.0, 3.0]
    return whole_recipe(tables)


def test_failures_in_range_still_end_a_generation(tmp_path: Path) -> None:
    wanted = asked(0.97)
    with refused(SimulationError, "1 may fail", "trajectories could"):
        generate(case_of(wanted), tmp_path / "trajectories", None, silent)


def test_keys_of_the_range_keep_the_trajectories_within_it(tmp_path: Path) -> None:
    path, beyond, within = tmp_path / "trajectories", asked(1.2), recipe(1.2, 3)
    total = generate(case_of(beyond), path, None, silent)
    before, failed = values(path, beyond), {one.name for one in failures_of(beyond, path)}
    assert failed
    assert (
        generate(case_of(within), path, None, silent) == 4 + 3 < total
    )  # others are as they were
    after = values(path, within)
    changed = {key for key in before if not np.array_equal(before[key], after[key])}
    assert changed <= {(split, i) for split, i in before if split_stream(beyond, split, i).beyond}
    assert all(np.abs(after[key]).max() <= 1.0 for key in after if key[0] in OF_ESTIMATOR)
    assert not [f for f in failures_of(within, path) if f.split.startswith("estimator")]
    assert generate(case_of(within), path, None, silent) == 0
    assert generate(case_of(beyond), path, None, silent) == 0
    again = values(path, beyond)
    assert all(np.array_equal(before[key], again[key]) for key in before)
    assert {one.name for one in failures_of(beyond, path)} == failed
