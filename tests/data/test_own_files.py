"""A recipe's own files travel with its data to workers that do not see its folder."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from slide_fmu.data.own_files import keep_own_files, use_own_files
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.systems import recipe_system
from tests.own_models.lag_beside import write_lag
from tests.recipes import tiny_recipe


@pytest.fixture(autouse=True)
def own_imports(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a test imports, and where from, is forgotten when it ends."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a recipe, with a model of two files and one that is not loaded."""
    found = write_lag(tmp_path / "recipe").parent
    (found / "not_loaded.py").write_text("raise SystemExit\n", encoding="utf-8")
    sys.path.append(str(found))
    return found


def kept(folder: Path, model: str = "own_lag.py") -> Path:
    """Keep the files of the recipe, whose system was made, with another name of the model."""
    recipe = load_recipe(folder / "lag.toml")
    system = recipe.system.model_copy(update={"model": model})
    recipe = recipe.model_copy(update={"system": system})
    recipe_system(recipe)
    return keep_own_files(recipe, folder, folder.parent / "runs" / "data.zarr")


def test_loaded_modules_and_named_files_are_kept_and_no_others(folder: Path) -> None:
    place = kept(folder)
    assert place.parent == folder.parent / "runs" / "own_files"
    assert sorted(file.name for file in place.iterdir()) == ["own_lag.py", "own_rate.py"]
    assert kept(folder) == place
    assert list(place.parent.iterdir()) == [place]


def test_changed_file_is_kept_in_another_folder(folder: Path) -> None:
    place = kept(folder)
    write_lag(folder, rate=3.0)
    assert kept(folder) != place


def test_recipe_without_own_files_has_an_empty_folder(tmp_path: Path) -> None:
    place = keep_own_files(tiny_recipe(), tmp_path, tmp_path / "data.zarr")
    assert list(place.iterdir()) == []


def test_file_outside_of_the_folder_of_the_recipe_is_refused(folder: Path) -> None:
    (folder / "inner").mkdir()
    sys.path.append(str(folder / "inner"))
    with pytest.raises(RecipeError, match=r"'\.\./own_lag\.py'; expected one in the folder"):
        kept(folder, "../own_lag.py")


def test_worker_forgets_modules_of_the_folder_that_it_used_before(tmp_path: Path) -> None:
    folders = []
    for number in (1, 2):
        folders.append(tmp_path / str(number))
        folders[-1].mkdir()
        (folders[-1] / "own_number.py").write_text(f"NUMBER = {number}\n", encoding="utf-8")
    found = []
    for folder in (folders[0], folders[0], folders[1]):
        changed = use_own_files(folder)
        import own_number

        found.append((changed, own_number.NUMBER))
    assert found == [(True, 1), (False, 1), (True, 2)]
    assert [str(folder) in sys.path for folder in folders] == [False, True]


def test_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        use_own_files(tmp_path / "none")
