"""A full disk is named, nothing half made stays, and the work goes on when there is room."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from tests.acceptance.conftest import SMALL_LINEAR, Finished, invoke
from tests.limits import fill, small_disk

pytestmark = pytest.mark.extended

RECIPE = SMALL_LINEAR.replace("steps = 1200", "steps = 40").replace(
    "validate_every = 300", "validate_every = 20"
)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk that the whole way fits on."""
    with small_disk(tmp_path, "8m") as place:
        yield place


def refused(*arguments: object) -> str:
    """Call the console script, which must say that the disk is full, and return what it says."""
    result = invoke(*arguments)
    assert result.exit_code == 1
    assert isinstance(result.exception, SystemExit)  # no traceback
    (line,) = [line for line in result.output.splitlines() if line.startswith("error:")]
    assert "cannot be written: the disk is full" in line
    assert "MB are free in" in line
    return line


def unfinished(folder: Path) -> list[str]:
    """Name what was written beside its place, and would have been renamed."""
    names = [path.name for path in folder.rglob("*")]
    return [name for name in names if name.startswith(".") or "partial" in name]


def test_every_stage_names_a_full_disk_and_goes_on_when_there_is_room(disk: Path) -> None:
    recipe, folder = disk / "small.toml", disk / "small_linear"
    recipe.write_text(RECIPE, encoding="utf-8")
    call = (recipe, "--runs", disk)

    filling = fill(disk)
    refused("generate", *call, "--workers", 1)
    assert not list(folder.rglob("*.npz"))
    filling.unlink()
    assert invoke("generate", *call, "--workers", 1).exit_code == 0

    filling = fill(disk)
    assert "checkpoints" in refused("train", *call)
    assert not (folder / "surrogate.slide").exists()
    filling.unlink()
    assert invoke("train", *call).exit_code == 0

    filling = fill(disk)
    assert "small_linear.fmu" in refused("export", *call)
    assert not (folder / "small_linear.fmu").exists()
    filling.unlink()
    assert invoke("export", *call).exit_code == 0
    assert unfinished(folder) == []

    fmu, few = folder / "small_linear.fmu", ("--trajectories", 1, "--workers", 1)
    filling, before = fill(disk), fmu.read_bytes()
    refused("run", *call, *few)
    assert fmu.read_bytes() == before
    filling.unlink()
    assert invoke("run", *call, *few).exit_code == 0
    assert "measured" in (read_fmu(fmu)[1] or {})
    assert unfinished(folder) == []


def test_data_that_fill_the_disk_are_completed_when_there_is_room(tmp_path: Path) -> None:
    recipe = tmp_path / "small.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    with small_disk(tmp_path, "80k") as disk:
        call = ("generate", recipe, "--runs", disk, "--workers", 2)
        assert "trajectories" in refused(*call)
        kept = tmp_path / "kept"
        shutil.copytree(disk, kept)
        assert unfinished(disk) == []
    figures = tmp_path / "figures.json"
    again = invoke("generate", recipe, "--runs", kept, "--workers", 2, "--json", figures)
    assert again.exit_code == 0, again.output
    made_now = json.loads(figures.read_text(encoding="utf-8"))["made_now"]
    assert 0 < made_now < 10  # some were there


def test_reports_and_figures_name_a_full_disk(disk: Path, linear: Finished) -> None:
    call = ("validate", linear.fmu, "--trajectories", 1, "--report", disk / "report")
    assert invoke(*call, "--json", disk / "figures.json").exit_code == 0
    before = (disk / "figures.json").read_bytes()
    fill(disk)
    assert "report.json" in refused(*call)
    elsewhere = ("--report", linear.runs / "report", "--json", disk / "figures.json")
    assert "figures.json" in refused(*call[:4], *elsewhere)
    assert (disk / "figures.json").read_bytes() == before
    assert unfinished(disk) == []


def test_fmu_that_is_there_stays_whole_where_the_disk_is_full(
    disk: Path, linear: Finished
) -> None:
    fmu = disk / "x.fmu"
    assert invoke("export", linear.fmu, "-o", fmu).exit_code == 0
    before = fmu.read_bytes()
    fill(disk)
    refused("export", linear.fmu, "-o", fmu, "--source")
    assert fmu.read_bytes() == before
    with zipfile.ZipFile(fmu) as archive:
        assert archive.testzip() is None
