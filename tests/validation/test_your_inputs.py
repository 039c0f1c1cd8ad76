"""An FMU is measured under a file of inputs as its user's importer would set them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.checks import faults
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.record_files.inputs import InputTable
from slide_fmu.validation.calls import ErrorLevels
from slide_fmu.validation.measure import Meter, your_rows
from slide_fmu.validation.row import YOURS
from slide_fmu.validation.your_inputs import JudgingPart, judging_parts, your_motions
from tests.progress import no_stages, silent
from tests.refusals import refused
from tests.validation.lag import LAG, STEP, lag_recipe, lag_surrogate


def driven_recipe(folder: Path, hold: Hold, learnt: float = 0.5) -> Recipe:
    """The lag with a file of 40 s, at an uneven clock, next to the kinds of its data."""
    rng = np.random.default_rng(3)
    times = 7.0 + np.cumsum(rng.uniform(0.02, 1.0, 80))
    drive = rng.uniform(-3.0, 5.0, 80)
    path = folder / "drive.csv"
    np.savetxt(path, np.stack([times, drive], 1), delimiter=",", header="t,drive", comments="")
    recipe = lag_recipe(folder, hold)
    values = recipe.model_dump()
    file = {"kind": "file", "weight": 1.0, "path": str(path), "learnt": learnt}
    values["data"]["excitation"] = [*values["data"]["excitation"], file]
    return Recipe.model_validate(values)


def exact(table: InputTable, hold: Hold, step: float) -> tuple[FloatArray, FloatArray]:
    """Times from the first sample on, and the answer of the lag to the file, from rest on."""
    fine = step / 64
    count = 64 * int(table.duration / step)
    middles = fine * (np.arange(count) + 0.5)
    if hold == "zero_order":
        middles = step * np.floor(middles / step)
    pole = np.exp(-fine / LAG)
    level, levels = table.at(np.zeros(1))[0, 0], []
    for value in table.at(middles)[:, 0]:
        levels.append(level)
        level = pole * level + (1 - pole) * value
    return fine * np.arange(count), np.array(levels)


@pytest.mark.parametrize("hold", ["first_order", "zero_order"])
@pytest.mark.parametrize("steps", [1.0, 4.0])
def test_truth_is_that_of_the_second_half_after_the_first(
    tmp_path: Path, hold: Hold, steps: float
) -> None:
    recipe = driven_recipe(tmp_path, hold)
    surrogate, case = lag_surrogate(recipe, hold), case_of(recipe)
    (part,) = judging_parts(recipe, surrogate)
    assert part.words == "second half of drive.csv"
    ((label, motion),) = your_motions(surrogate, case, [part], steps, silent).items()
    assert (label.group, label.inputs) == (YOURS, "second half of drive.csv")
    table = part.table
    lead = round(motion.first / STEP)
    first = np.floor(part.begin / STEP)  # sample of the file at which outputs begin to count
    times, levels = exact(table, hold, STEP / steps if hold == "zero_order" else STEP)
    scored = motion.truth[lead * round(STEP / motion.grid) :: round(STEP / motion.grid), 0]
    wanted = np.interp(STEP * (first + np.arange(len(scored))), times, levels)
    assert len(scored) == pytest.approx((table.duration - part.begin) / STEP, abs=2)
    assert scored[:-2] == pytest.approx(wanted[:-2], abs=2e-3 * np.ptp(levels))
    at = motion.course(STEP * (lead + np.arange(50.0)))[:, 0]
    assert at == pytest.approx(table.at(STEP * (first + np.arange(50.0)))[:, 0])


def test_a_whole_file_counts_from_its_first_sample_after_a_rest_there(tmp_path: Path) -> None:
    recipe = driven_recipe(tmp_path, "first_order")
    surrogate, case = lag_surrogate(recipe, "first_order"), case_of(recipe)
    (known,) = judging_parts(recipe, surrogate)
    part = JudgingPart("drive.csv", known.table, 0.0)
    ((_, motion),) = your_motions(surrogate, case, [part], 1.0, silent).items()
    first = known.table.values[0, 0]
    assert motion.course(np.array([0.0, motion.first]))[:, 0] == pytest.approx([first, first])
    assert motion.truth[round(motion.first / motion.grid), 0] == pytest.approx(first, abs=1e-6)


def test_rows_have_the_error_in_every_call_relative_to_the_file(tmp_path: Path) -> None:
    recipe = driven_recipe(tmp_path, "first_order")
    surrogate, case = lag_surrogate(recipe, "first_order"), case_of(recipe)
    fmu = export_fmu(surrogate, tmp_path / "tiny.fmu")
    parts = judging_parts(recipe, surrogate)
    with unpacked(fmu) as files:
        meter = Meter(files, surrogate, ErrorLevels(np.zeros(1)))
        rows = your_rows(meter, case, parts, no_stages)
    assert [(row.call, row.steps) for row in rows] == [("plain", 1), ("plain", 4), ("known", 1)]
    assert all(row.group == YOURS and row.trajectories == 1 for row in rows)
    count = (parts[0].table.duration - parts[0].begin) / STEP
    assert rows[0].samples == pytest.approx(count, abs=2)
    # straight lines with corners within the steps: exact but for these where they are known
    assert rows[2].error < rows[0].error < 0.2
    ((_, motion),) = your_motions(surrogate, case, parts, 1.0, silent).items()
    truth = motion.truth[round(motion.first / motion.grid) :]
    assert rows[0].outputs[0].rmse / truth.std() == pytest.approx(rows[0].error, rel=1e-9)


def test_files_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    recipe = driven_recipe(tmp_path, "first_order")
    file = recipe.data.excitation[-1]
    (tmp_path / "other").mkdir()
    path = str(tmp_path / "other" / "drive.csv")
    Path(path).write_text("t,drive\n0,1\n30,2\n", encoding="utf-8")
    values = recipe.model_dump()
    more = {**file.model_dump(), "path": path, "digest": None}
    values["data"]["excitation"] = [*values["data"]["excitation"], more]
    recipe = Recipe.model_validate(values)
    words = [p.words for p in judging_parts(recipe, lag_surrogate(recipe, "first_order"))]
    assert words == [f"second half of {one}" for one in (str(tmp_path / "drive.csv"), path)]


def test_files_must_last_a_window_in_each_part_and_judge_among_the_data(tmp_path: Path) -> None:
    assert not faults(driven_recipe(tmp_path, "first_order"), ())
    (fault,) = faults(driven_recipe(tmp_path, "first_order", learnt=0.95), ())
    for word in ("'drive.csv' lasts", "are learnt and the rest judges", "100 s", "5 s"):
        assert word in fault
    recipe = driven_recipe(tmp_path, "first_order")
    (file,) = recipe.data.excitation[-1:]
    held_out = recipe.validation.model_copy(update={"excitation": (file,)})
    data = recipe.data.model_copy(update={"excitation": recipe.data.excitation[:-1]})
    moved = recipe.model_copy(update={"validation": held_out, "data": data})
    assert any("only files of data.excitation judge" in text for text in faults(moved, ()))


def test_a_model_that_fails_names_the_file(tmp_path: Path) -> None:
    recipe = driven_recipe(tmp_path, "first_order")
    surrogate, case = lag_surrogate(recipe, "first_order"), case_of(recipe)
    model = tmp_path / "lag.py"
    model.write_text(model.read_text().replace("return [(u", "assert u[0] < 4.0\n    return [(u"))
    with refused(RuntimeError, "your inputs, second half of drive.csv", "correct the file"):
        your_motions(surrogate, case, judging_parts(recipe, surrogate), 1.0, silent)
