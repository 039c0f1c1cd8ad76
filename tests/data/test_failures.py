"""Trajectories that fail are kept with their inputs; others take their place, or the run ends."""

from __future__ import annotations

import shutil
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.data import failures, trajectories
from slide_fmu.data.draws import draw, split_stream
from slide_fmu.data.failures import (
    Failure,
    allowed_failures,
    failures_folder,
    kept_failures,
)
from slide_fmu.data.generation import generate
from slide_fmu.data.model_answers import identity
from slide_fmu.data.pool import process_pool
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.pipeline.case_checks import check_case
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import SimulationError
from tests.data.failing_system import FailingSystem
from tests.data.test_generation import Inline
from tests.marks import first
from tests.progress import silent
from tests.recipes import tiny_recipe, whole_recipe
from tests.refusals import refused
from tests.trajectories import read_split

TRAIN = 30
LEVEL = 0.97
"""Inputs above it fail."""


def failing(most_failures: float = 0.5, **parameters: float) -> Recipe:
    """A recipe whose inputs are held values: some of its trajectories reach any level."""
    recipe = tiny_recipe(
        window={"step": 0.1, "n_in": 8, "n_out": 4},
        data={"duration": 1.0, "train": TRAIN, "most_failures": most_failures},
    )
    model = "tests.data.failing_system:FailingSystem"
    system = recipe.system.model_copy(update={"model": model, "parameters": parameters})
    return recipe.model_copy(update={"system": system})


def made(recipe: Recipe, path: Path, executor: Executor | None = None) -> list[Failure]:
    generate(case_of(recipe), path, executor or Inline(), silent)
    return failures_of(recipe, path)


def failures_of(recipe: Recipe, path: Path) -> list[Failure]:
    return kept_failures(case_of(recipe), path)


@dataclass(frozen=True)
class FailedRun:
    """A recipe some of whose trajectories failed, where these are, and these failures."""

    recipe: Recipe
    folder: Path
    failures: list[Failure]

    def inputs(self, failure: Failure) -> Path:
        (path,) = failures_folder(self.folder).glob(f"{failure.name}-*.csv")
        return path


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> FailedRun:
    recipe, folder = failing(fail=LEVEL), tmp_path_factory.mktemp("failed") / "trajectories"
    return FailedRun(recipe, folder, made(recipe, folder))


def failed_first(recipe: Recipe, level: float) -> list[int]:
    """Give the training trajectories whose first draw has an input above a level."""
    system = case_of(recipe).system
    draws = [draw(recipe, system, split_stream(recipe, "train", i), i) for i in range(TRAIN)]
    return [i for i, drawn in enumerate(draws) if np.max(drawn.inputs) > level]


@pytest.mark.extended
def test_another_draw_takes_the_place_of_one_that_fails(failed: FailedRun) -> None:
    recipe, failures = failed.recipe, failed.failures
    wanted = failed_first(recipe, LEVEL)
    assert 0 < len(wanted) < TRAIN
    assert sorted({f.index for f in failures if f.split == "train"}) == wanted
    split, system = read_split(recipe, failed.folder, "train"), case_of(recipe).system
    for index in range(TRAIN):
        attempt = len([f for f in failures if f.split == "train" and f.index == index])
        drawn = draw(recipe, system, split_stream(recipe, "train", index), index, attempt)
        np.testing.assert_array_equal(split.inputs[index], drawn.inputs[drawn.burn_in :])
    assert np.max(split.inputs) <= LEVEL


@pytest.mark.extended
def test_failures_are_the_same_in_worker_processes(tmp_path: Path) -> None:
    recipe = failing(fail=0.97)
    alone = made(recipe, tmp_path / "alone" / "trajectories")
    with process_pool(2) as pool:
        together = made(recipe, tmp_path / "together" / "trajectories", pool)
    assert alone == together
    for name in ("train", "validation"):
        one, other = (
            read_split(recipe, tmp_path / f / "trajectories", name) for f in ("alone", "together")
        )
        np.testing.assert_array_equal(one.inputs, other.inputs)


def test_a_failure_is_kept_with_its_time_its_inputs_and_what_was_said(failed: FailedRun) -> None:
    recipe, failure = failed.recipe, failed.failures[0]
    assert failure.time_s is not None
    assert failure.error == f"no solution at t = {failure.time_s:g} s"
    path = failed.inputs(failure)
    assert path.read_text().splitlines()[0] == "time,force"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    stream = split_stream(recipe, failure.split, failure.index)
    drawn = draw(recipe, case_of(recipe).system, stream, failure.index, failure.attempt)
    np.testing.assert_array_equal(table[:, 1:], drawn.inputs)
    np.testing.assert_allclose(table[:, 0], 0.1 * np.arange(len(table)), rtol=1e-12)
    assert table[round(failure.time_s / 0.1), 1] > LEVEL


def test_inputs_that_failed_can_drive_a_recipe(failed: FailedRun) -> None:
    failure = failed.failures[0]
    path = failed.inputs(failure)
    values = failed.recipe.model_dump(mode="json")
    values["data"]["excitation"] = [{"kind": "file", "weight": 1.0, "path": str(path)}]
    recipe = whole_recipe(values)
    check = case_of(recipe).system
    drawn = draw(recipe, check, split_stream(recipe, "train", 0), 0)
    values_in_file = np.loadtxt(path, delimiter=",", skiprows=1)[:, 1]
    distance = np.abs(drawn.inputs - values_in_file).min(axis=1)
    np.testing.assert_allclose(distance, 0.0, rtol=0, atol=1e-12)  # its input is held


def test_an_output_that_is_no_number_is_a_failure(tmp_path: Path) -> None:
    recipe = failing(broken=0.97)
    failures = made(recipe, tmp_path / "trajectories")
    assert "output 'position' = nan m in sample " in failures[0].error
    assert np.isfinite(read_split(recipe, tmp_path / "trajectories", "train").outputs).all()


def test_too_many_failures_end_the_generation_with_the_reason(tmp_path: Path) -> None:
    recipe = failing(0.02, fail=0.9)
    assert allowed_failures(recipe) == 1
    expected = (
        r"\d+ trajectories could not be simulated, 1 may fail.*failures has the inputs.*train_"
    )
    with pytest.raises(SimulationError, match=expected):
        made(recipe, tmp_path / "trajectories")
    before = len(failures_of(recipe, tmp_path / "trajectories"))
    more = failing(0.9, fail=0.9)  # allowed more, it goes on where it was
    assert len(made(more, tmp_path / "trajectories")) > before
    assert len(read_split(more, tmp_path / "trajectories", "train").inputs) == TRAIN


@pytest.mark.extended
def test_failures_that_another_program_removes_meanwhile_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = case_of(failing(0.0))
    gone = {f"train_{index}_0": tmp_path / f"{index}.json" for index in range(9)}
    monkeypatch.setattr(failures, "_files", lambda _: gone)
    assert failures.too_many_failures(Trajectories(tmp_path, case, "model")) is None


def test_a_corrected_model_is_simulated_again_where_the_former_one_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe, folder = failing(0.02, fail=LEVEL), tmp_path / "trajectories"
    for _ in range(2):
        with refused(SimulationError, "trajectories could not be simulated"):
            made(recipe, folder)
    known = identity(case_of(recipe).source, recipe)  # a change elsewhere does not show in it
    monkeypatch.setattr(trajectories, "identity", lambda *_: known)
    monkeypatch.setattr(
        FailingSystem, "simulate", lambda _, inputs: np.vstack([inputs[:1], inputs])
    )
    assert made(recipe, folder) == []
    assert len(read_split(recipe, folder, "train").inputs) == TRAIN


def test_a_system_that_always_fails_ends_the_generation(tmp_path: Path) -> None:
    recipe = failing(0.1, fail=-1.0)
    with refused(SimulationError, "no solution"):
        made(recipe, tmp_path / "trajectories")


def test_a_damaged_file_of_a_failure_is_named(failed: FailedRun, tmp_path: Path) -> None:
    shutil.copytree(failures_folder(failed.folder), tmp_path / "failures")
    path = next((tmp_path / "failures").glob("*.json"))
    path.write_text('{"split": "train"', encoding="utf-8")
    with refused(DamagedFileError, f"{path.name} is damaged", "remove it"):
        failures_of(failed.recipe, tmp_path / "trajectories")


def test_failures_of_other_values_do_not_count(failed: FailedRun) -> None:
    assert failures_of(failing(fail=LEVEL), failed.folder) == failed.failures
    assert failures_of(failing(fail=2.0), failed.folder) == []


@pytest.mark.extended
def test_a_crash_in_a_worker_is_told_with_the_model(tmp_path: Path) -> None:
    recipe = failing(crash=0.99)
    expected = "FailingSystem.*ended the process that simulated it: its library crashed"
    with process_pool(1) as pool, pytest.raises(SimulationError, match=expected):
        made(recipe, tmp_path / "trajectories", pool)


@pytest.mark.parametrize("crash", first([9.0, -1.0]))
def test_a_system_that_may_crash_is_tried_in_a_process_of_its_own(crash: float) -> None:
    recipe = failing(crash=crash)
    if crash > 1:
        check_case(case_of(recipe))
        return
    with refused(SimulationError, "ended the process"):
        check_case(case_of(recipe))
