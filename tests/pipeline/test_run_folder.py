"""A trained surrogate belongs to the recipe that it was learnt from."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.core.search_path import make_importable, make_models_importable
from slide_fmu.pipeline.run_folder import RunFolder, StageError, TrainedSurrogate
from tests.fmu.samples import sum_surrogate
from tests.recipes import tiny_recipe
from tests.refusals import refused

RECIPE = tiny_recipe()


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    """One in which a surrogate was trained."""
    found = RunFolder(tmp_path)
    found.save_training(TrainedSurrogate(sum_surrogate(), {}, {}), RECIPE, "key")
    return found


@pytest.mark.parametrize(
    "changes",
    [
        {"system": {"reference": {"substeps": 24}}},
        {"system": {"picture": "mbs_models.pictures.drawing:robot_picture"}},
        {"apps": {"page": {"drawing": "mbs_models.pictures.page_drawings:robot"}}},
        {"validation": {"trajectories": 3}},
        {"stability": {"allow_unstable": True}},
        {"description": "said in other words", "equations": "y = u"},
    ],
)
def test_how_it_is_measured_or_described_changes_no_surrogate(
    folder: RunFolder, changes: dict[str, Any]
) -> None:
    changed = tiny_recipe(**changes)
    assert folder.load_surrogate(changed).surrogate.to_bytes() == sum_surrogate().to_bytes()


def test_another_reference_needs_no_other_surrogate(folder: RunFolder) -> None:
    folder.load_surrogate(tiny_recipe(system={"reference": {"substeps": 24}}))


@pytest.mark.parametrize(
    "changes",
    [
        {"system": {"parameters": {"substeps": 24}}},
        {"training": {"steps": 41}},
        {"stability": {"amplitudes": [1.0, 2.0]}},  # it decides where cubes are clipped
        {"stability": {"contraction_beyond": 5.0}},
    ],
)
def test_another_system_or_training_needs_another_surrogate(
    folder: RunFolder, changes: dict[str, Any]
) -> None:
    with refused(StageError, "was trained from other values"):
        folder.load_surrogate(tiny_recipe(**changes))


def test_training_is_known_by_its_key_alone(folder: RunFolder) -> None:
    known = folder.known_training("key")
    assert known is not None
    assert known.surrogate.to_bytes() == sum_surrogate().to_bytes()
    assert folder.known_training("another key") is None


@pytest.mark.parametrize("file", ["surrogate.slide", "training.json"])
def test_training_with_a_damaged_file_is_not_known(folder: RunFolder, file: str) -> None:
    place = folder.path / file
    place.write_bytes(place.read_bytes()[:-20])
    assert folder.known_training("key") is None
    place.unlink()
    assert folder.known_training("key") is None


@pytest.mark.parametrize("part", [0.0, 0.5])
def test_damaged_record_of_a_training_is_named(folder: RunFolder, part: float) -> None:
    whole = folder.training.read_bytes()
    folder.training.write_bytes(whole[: int(part * len(whole))])
    with refused(DamagedFileError, "training.json is damaged", "train again"):
        folder.load_surrogate(RECIPE)


@pytest.mark.parametrize("part", [0.0, 0.5])
def test_damaged_surrogate_is_named(folder: RunFolder, part: float) -> None:
    whole = folder.surrogate.read_bytes()
    folder.surrogate.write_bytes(whole[: int(part * len(whole))])
    with refused(StageError, "surrogate.slide and", "train again"):
        folder.load_surrogate(RECIPE)


def test_file_in_the_place_of_the_folder_is_named(tmp_path: Path) -> None:
    RunFolder(tmp_path / "new" / "x").require_folder()
    (tmp_path / "runs").write_text("no folder", encoding="utf-8")
    with refused(StageError, "expected a folder", "runs is", "--runs"):
        RunFolder(tmp_path / "runs" / "x").require_folder()


def test_model_of_an_fmu_is_found_where_its_recipe_most_likely_lay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That is here, beside the folder of the runs, or beside the FMU: no PYTHONPATH is needed."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setattr(sys, "path", ["kept"])
    make_models_importable(tmp_path / "work" / "runs" / "pump" / "pump.fmu")
    places = [here, tmp_path / "work", tmp_path / "work" / "runs" / "pump"]
    assert sys.path == ["kept", *map(str, places)]


def test_folder_of_the_newest_recipe_comes_before_those_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", ["kept"])
    first, second = str(tmp_path / "first"), str(tmp_path / "second")
    for place, expected in ((first, [first]), (second, [second, first]), (first, [first, second])):
        make_importable(Path(place))
        assert sys.path == ["kept", *expected]
