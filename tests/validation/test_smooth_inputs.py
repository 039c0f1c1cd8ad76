"""Rows of smooth inputs are what ``fmpy.simulate_fmu`` gives its user at any step."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import fmpy
import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.signal import lfilter

from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation import smooth_inputs, speed, tones
from slide_fmu.validation.calls import ErrorLevels, MeasuredMotion
from slide_fmu.validation.measure import rows_of
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import ALL, AS_SET, CONSTANT, SMOOTH, TONES, Call, Row, row_at
from slide_fmu.validation.smooth_inputs import (
    STEPS,
    Sines,
    SmoothMotions,
    band_of,
    fine_truths,
    model_rows,
)
from slide_fmu.validation.task import IN_RANGE, Task
from slide_fmu.validation.validate import validate
from tests.libraries import build_libraries
from tests.progress import no_stages, silent
from tests.recipes import tiny_recipe
from tests.validation.lag import LAG, STEP, WINDOW, lag_recipe, lag_surrogate

FEW = 2
Case = tuple[Path, Validation, tuple[Row, ...]]


@pytest.fixture(scope="module")
def few_smooth() -> Iterator[None]:
    """Few trajectories, one band of tones and no search for a speed: these take most time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tones, "COLUMNS", 1)
        patch.setattr(speed, "LONGEST", 0.0)
        patch.setattr(smooth_inputs, "TRAJECTORIES", FEW)
        yield


@pytest.fixture(scope="module", params=["zero_order", "first_order"])
def case(
    few_smooth: None, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Case:
    build_libraries()
    folder = tmp_path_factory.mktemp("plain")
    recipe = lag_recipe(folder, request.param)
    fmu = export_fmu(lag_surrogate(recipe, request.param), folder / "tiny.fmu")
    surrogate, _ = read_fmu(fmu)
    validation = validate(fmu, surrogate, case_of(recipe), Task(3, trajectories=2), silent)
    usual = validation.usual_error()
    rows = rows_of(fmu, {IN_RANGE: validation}, case_of(recipe), usual, no_stages)
    return fmu, validation, rows


def smooth(rows: tuple[Row, ...], call: Call, steps: float) -> Row | None:
    name = next(row.inputs for row in rows if row.group == SMOOTH)
    return row_at(rows, SMOOTH, name, call, steps)


def error(rows: tuple[Row, ...], call: Call, steps: float) -> float:
    row = smooth(rows, call, steps)
    assert row is not None
    return row.error


def user_call(
    fmu: Path, surrogate: Surrogate, times: FloatArray, rows: FloatArray, step: float
) -> FloatArray:
    """``fmpy.simulate_fmu(fmu, input=table)``, as it stands in any script: (N + 1, n_outputs)."""
    names = [signal.name for signal in surrogate.inputs]
    table = np.zeros(len(times), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = times
    for index, name in enumerate(names):
        table[name] = rows[:, index]
    outputs = [signal.name for signal in surrogate.outputs]
    stop = step * round(times[-1] / step)
    found = fmpy.simulate_fmu(
        str(fmu), stop_time=stop, output_interval=step, input=table, output=outputs
    )
    return np.stack([found[name] for name in outputs], axis=1)


def relative(errors: list[FloatArray], truths: list[FloatArray]) -> FloatArray:
    error, truth = np.concatenate(errors), np.concatenate(truths)
    return np.asarray(np.sqrt(np.mean(error**2, axis=0)) / truth.std(axis=0))


def test_held_inputs_at_a_shorter_step_count_between_samples_too(case: Case) -> None:
    """At multiples of the own step, held inputs are exact at any communication step."""
    _, validation, rows = case
    own, finer = (row_at(rows, IN_RANGE, ALL, "plain", steps) for steps in (1.0, 4.0))
    assert own is not None
    assert finer is not None
    if validation.surrogate.hold == "zero_order":
        assert finer.counted > 2 * own.counted
        assert finer.error > 3 * own.error
    else:
        assert finer.counted == pytest.approx(own.counted, abs=2)


@pytest.mark.extended
@pytest.mark.parametrize("parts", [1, 4])
def test_rows_of_smooth_inputs_are_what_a_user_gets(case: Case, parts: int) -> None:
    """The truth is that of the lag under the sines themselves, by a filter of 32 parts a step."""
    fmu, validation, rows = case
    surrogate, hz, every = validation.surrogate, band_of(validation.recipe), 32 // parts
    errors, truths = [], []
    for index in range(FEW):
        fine = STEP / 32 * np.arange(32 * 900 + 1)
        drive = Sines(surrogate.inputs, hz, index, validation.task.seed)(fine)
        pole = np.exp(-STEP / 32 / LAG)
        level = lfilter([(1 - pole) / 2, (1 - pole) / 2], [1, -pole], drive[:, 0])[::every, None]
        got = user_call(fmu, surrogate, fine[::every], drive[::every], STEP / parts)
        errors.append((got - level)[WINDOW * parts :])
        truths.append(level[WINDOW * parts :])
    printed = error(rows, "plain", parts)
    assert float(relative(errors, truths)[0]) == pytest.approx(printed, rel=0.2)


@pytest.mark.extended
def test_smooth_inputs_go_on_within_a_step_where_the_finest_model_holds_them(case: Case) -> None:
    _, validation, rows = case
    held = validation.surrogate.hold == "zero_order"
    for steps in (1, 2):
        assert error(rows, "plain", steps) < 0.5 * error(rows, "model", steps)
    assert error(rows, "model", 2) == pytest.approx(error(rows, "model", 1) / 2, rel=0.1)
    if not held:
        assert error(rows, "known", 1) < error(rows, "plain", 1)


def test_finest_model_that_says_itself_that_inputs_are_held_has_a_row_at_every_step() -> None:
    """``lag_recipe`` sets the hold in the recipe; a model of the package declares its own."""
    recipe = tiny_recipe()
    case = case_of(recipe)
    signals, hz, step = case.reference.inputs, band_of(recipe), recipe.window.step
    sines, system = Sines(signals, hz, 0, 3), case.reference_as_it_runs()
    (truth,) = fine_truths(system, [sines], [800])
    assert isinstance(truth, np.ndarray)
    motion = MeasuredMotion(sines, truth, system.step, 10 * step)
    found = SmoothMotions((motion,), system, hz)
    outputs = case.reference.outputs
    levels = ErrorLevels(np.zeros(len(outputs)))
    errors = [row.error for row in model_rows(found, case, outputs, levels, step)]
    assert len(errors) == len(STEPS)
    assert errors == sorted(errors, reverse=True)


@pytest.mark.extended
def test_every_kind_has_a_row_in_the_plain_call_at_both_steps(case: Case) -> None:
    _, validation, rows = case
    kinds = {(row.group, row.inputs) for row in rows}
    assert {group for group, _ in kinds} == {IN_RANGE, SMOOTH, CONSTANT, TONES, AS_SET}
    calls = {"plain"} if validation.surrogate.hold == "zero_order" else {"plain", "known"}
    for group, inputs in kinds:
        for steps in (1.0, 4.0):
            assert row_at(rows, group, inputs, "plain", steps) is not None
        found = {r.call for r in rows if (r.group, r.inputs) == (group, inputs)}
        assert found - {"model"} == ({"plain"} if group == TONES else calls)


def test_smooth_inputs_are_no_faster_than_wide_motions_of_the_training(case: Case) -> None:
    """A kind that is fast, but small, says nothing about sines through a third of the range."""
    recipe = case[1].recipe
    tables = [
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.1, 0.5],
         "angular_frequency": [0.1, 2.0]},
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.01, 0.1],
         "angular_frequency": [2.0, 60.0]},
    ]  # fmt: skip
    kinds = TypeAdapter(tuple[Excitation, ...]).validate_python(tables)
    assert band_of(recipe.with_kinds(kinds))[1] == pytest.approx(2.0 / (2 * np.pi))
    assert band_of(recipe.with_kinds(kinds[1:]))[1] == pytest.approx(1 / (16 * STEP))


def test_an_input_that_moves_alone_moves_no_faster_than_the_other_kinds(case: Case) -> None:
    recipe = case[1].recipe
    tables = [
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.01, 0.1],
         "angular_frequency": [0.1, 2.0]},
        {"kind": "one_at_a_time", "weight": 1.0},
    ]  # fmt: skip
    kinds = TypeAdapter(tuple[Excitation, ...]).validate_python(tables)
    assert band_of(recipe.with_kinds(kinds))[1] == pytest.approx(2.0 / (2 * np.pi))


def test_reference_without_a_finer_step_has_no_smooth_sines(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where inputs move, the motions of the training take their place."""
    fmu, validation, _ = case
    coarse = case_of(validation.recipe).reference
    monkeypatch.setattr("slide_fmu.recipe.case.load_system", lambda _: coarse)
    usual, job = validation.usual_error(), case_of(validation.recipe)
    rows = rows_of(fmu, {IN_RANGE: validation}, job, usual, no_stages)
    names = {row.inputs for row in rows if row.group == SMOOTH}
    moving = validation.surrogate.hold == "first_order"
    assert names == ({"motions in range"} if moving else set())


def test_model_that_names_its_step_runs_as_its_importer_would(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its moving inputs are held over its own step."""
    recipe = lag_recipe(tmp_path, "first_order")
    monkeypatch.setattr(System, "own_step", STEP / 4)
    assert case_of(recipe).reference.inputs[0].hold == "first_order"
    system = case_of(recipe).reference_as_it_runs()
    assert system.inputs[0].hold == "zero_order"
    assert system.step == STEP / 4
