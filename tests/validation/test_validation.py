"""Measuring an FMU: against its reference, over the trajectories that the task asks for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.measure import motions_by_kind
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.progress import silent
from tests.recipes import tiny_recipe
from tests.refusals import refused
from tests.validation.tiny_validation import (
    FINER,
    MODEL,
    PLAIN,
    TASK,
    accuracy_section,
    measured,
    same,
)


def test_an_fmu_is_measured_against_the_finer_model(finer: Validation) -> None:
    """All of it against a computation from the models themselves."""
    reference, model = case_of(FINER).reference, case_of(FINER).system
    true, rough, scored = [], [], []
    for index, comparison in enumerate(finer.comparisons):
        stream = Stream(TEST, 3, (1.0, 1.0), 2.0)
        drawn = draw(FINER, reference, stream, index)
        assert np.array_equal(drawn.inputs, draw(FINER, model, stream, index).inputs)
        first = len(drawn.inputs) + 1 - len(comparison.time)
        true.append(simulate(reference, drawn.inputs, drawn.initial).outputs[first:])
        rough.append(simulate(model, drawn.inputs, drawn.initial).outputs[first:])
        scored.append(comparison)
        assert comparison.reference == pytest.approx(true[-1], abs=1e-12)
        assert comparison.model == pytest.approx(rough[-1], abs=1e-12)
    difference = np.concatenate(rough) - np.concatenate(true)
    moved = np.concatenate(true) - np.concatenate(true).mean(axis=0)
    relative = np.linalg.norm(difference) / np.linalg.norm(moved)
    (output,) = finer.figures().outputs
    assert 1e-6 < relative < 0.5
    assert output.model_relative_rmse == pytest.approx(relative, rel=1e-9)
    error = np.concatenate([c.surrogate - c.reference for c in scored])
    assert output.rmse == pytest.approx(np.sqrt(np.mean(error**2)))


def test_recipe_without_a_reference_of_its_own_has_no_model_error(
    fmu: Path, surrogate: Surrogate, finer: Validation
) -> None:
    plain = measured(fmu, surrogate, PLAIN)
    assert plain.figures().outputs[0].model_relative_rmse is None
    assert all(comparison.model is None for comparison in plain.comparisons)
    for one, other in zip(plain.comparisons, finer.comparisons, strict=True):
        assert one.reference == pytest.approx(other.model, abs=1e-12)
    table = accuracy_section(plain).table
    assert table is not None
    assert len(table.heading) == 7


def test_fmus_of_fmi_2_and_fmi_3_give_the_same_comparison(
    surrogate: Surrogate, finer: Validation, tmp_path: Path
) -> None:
    fmu = export_fmu(surrogate, tmp_path / "tiny.fmu", fmi=3)
    three = measured(fmu, surrogate, FINER)
    for one, other in zip(three.comparisons, finer.comparisons, strict=True):
        assert same(one, other)


def test_task_without_numbers_takes_those_of_the_recipe(fmu: Path, surrogate: Surrogate) -> None:
    recipe = tiny_recipe(
        system={"parameters": MODEL}, validation={"trajectories": 2, "duration": 1.5}
    )
    found = validate(fmu, surrogate, case_of(recipe), Task(seed=3), silent)
    assert [comparison.time[-1] for comparison in found.comparisons] == [1.75, 1.75]  # burn-in too
    given = validate(
        fmu, surrogate, case_of(recipe), Task(3, trajectories=1, duration=1.25), silent
    )
    assert [comparison.time[-1] for comparison in given.comparisons] == [1.5]
    plain = tiny_recipe(system={"parameters": MODEL}, validation={"trajectories": 1})
    (alone,) = validate(fmu, surrogate, case_of(plain), Task(seed=3), silent).comparisons
    assert alone.time[-1] == 0.25 + plain.data.duration


def test_progress_of_a_validation_counts_every_trajectory(fmu: Path, surrogate: Surrogate) -> None:
    calls: list[tuple[int, int]] = []
    found = validate(fmu, surrogate, case_of(PLAIN), TASK, lambda *numbers: calls.append(numbers))
    assert calls == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert len({comparison.reference.tobytes() for comparison in found.comparisons}) == 3


@pytest.mark.parametrize(("missing", "fits"), [(0.4, True), (0.5, True), (0.6, False)])
def test_duration_may_be_short_of_the_least_by_half_a_step(
    fmu: Path, surrogate: Surrogate, missing: float, fits: bool
) -> None:
    step = PLAIN.window.step
    task = Task(3, trajectories=1, duration=PLAIN.shortest_validation() - missing * step)
    if fits:
        assert len(validate(fmu, surrogate, case_of(PLAIN), task, silent).comparisons) == 1
    else:
        with refused(ValueError, "expected at least 0.5 s", "FMU's windows"):
            validate(fmu, surrogate, case_of(PLAIN), task, silent)


def test_rows_of_kinds_that_a_recipe_has_twice_say_which_one_they_are(finer: Validation) -> None:
    kinds = [
        {"kind": "harmonic", "weight": 1.0, "angular_frequency": [low, 9.0]} for low in (1.0, 4.0)
    ]
    comparisons = tuple(replace(one, kind=1 - k) for k, one in enumerate(finer.comparisons[:2]))
    changed = replace(
        finer, recipe=tiny_recipe(data={"excitation": kinds}), comparisons=comparisons
    )
    names = ["harmonic 1 of 1 to 9 rad/s", "harmonic 2 of 4 to 9 rad/s"]
    assert list(motions_by_kind(changed)) == names
