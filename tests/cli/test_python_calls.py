"""Subcommands as public functions: ``slide.run``, ``slide.export``, ``slide.validate``."""

from __future__ import annotations

from pathlib import Path

import pytest

import slide_fmu as slide
from slide_fmu.fmu.export import read_fmu
from tests.recipes import TINY
from tests.refusals import refused

ROOT = Path(__file__).parents[2]
LINEAR = ROOT / "fmus" / "linear" / "linear.fmu"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recipe of the quickest training that there is."""
    place = tmp_path_factory.mktemp("calls")
    (place / "tiny.toml").write_text(TINY, encoding="utf-8")
    return place


def test_run_of_a_recipe_gives_surrogate_fmu_report_and_errors(folder: Path) -> None:
    found = slide.run(folder / "tiny.toml", runs=folder / "runs", trajectories=1, workers=0)
    assert found.fmu == folder / "runs" / "tiny" / "tiny.fmu"
    assert found.surrogate.to_bytes() == read_fmu(found.fmu)[0].to_bytes()
    assert list(found.errors) == ["position"]
    assert found.figures["command"] == "slide-fmu run tiny.toml"


def test_run_of_a_missing_recipe_names_it(folder: Path) -> None:
    with refused(slide.RecipeError, "nothere.toml' cannot be read"):
        slide.run(folder / "nothere.toml", runs=folder / "runs")


def test_validate_measures_on_the_trajectories_that_it_is_told() -> None:
    figures = slide.validate(LINEAR, trajectories=1, duration=5.0, workers=0)
    assert figures["trajectories"] == 1
    (output,) = figures["outputs"]
    assert output["relative_rmse"] < 1e-3
    with refused(ValueError, "expected a positive, finite time"):
        slide.validate(LINEAR, duration=float("nan"))


@pytest.mark.parametrize("kind", ["surrogate", "surrogate file", "fmu"])
def test_export_takes_a_surrogate_or_the_path_of_one(kind: str, tmp_path: Path) -> None:
    surrogate = slide.load(LINEAR)
    surrogate.save(tmp_path / "linear.slide")
    source = {"surrogate": surrogate, "surrogate file": tmp_path / "linear.slide", "fmu": LINEAR}
    path = slide.export(source[kind], tmp_path / "again.fmu", fmi=3)  # type: ignore[arg-type]
    again, origin = read_fmu(path)
    assert again.to_bytes() == surrogate.to_bytes()
    assert (origin is not None) == (kind == "fmu")


def test_export_of_something_else_is_refused() -> None:
    with refused(slide.FmuError, "expected a surrogate", "the path"):
        slide.export(3, "x.fmu")  # type: ignore[arg-type]
