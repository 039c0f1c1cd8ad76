"""A damaged FMU in the run folder is named by who reads it, and written anew by who makes it."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu, read_member
from tests.acceptance.conftest import Finished, invoke
from tests.marks import essential, of_app


def other_zip() -> bytes:
    """Return a zip archive that is no FMU."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("a.txt", "no FMU")
    return packed.getvalue()


DAMAGES = ["half", "empty", "other zip", "no zip"]


def damage(fmu: Path, kind: str) -> None:
    """Damage an FMU in a way that users meet."""
    whole = fmu.read_bytes()
    fmu.write_bytes(
        {
            "half": whole[: len(whole) // 2],
            "empty": b"",
            "other zip": other_zip(),
            "no zip": b"<html>not found</html>",
        }[kind]
    )


@pytest.fixture
def copied(duffing: Finished, tmp_path: Path) -> Finished:
    """The small Duffing recipe, finished, in a folder of its own."""
    shutil.copytree(duffing.runs, tmp_path / "runs")
    return Finished(duffing.recipe, tmp_path / "runs", duffing.name, duffing.figures)


@pytest.mark.extended
@pytest.mark.parametrize("kind", essential(DAMAGES, "half"))
def test_export_says_that_the_fmu_was_damaged_and_writes_it_anew(
    copied: Finished, kind: str
) -> None:
    before = read_fmu(copied.fmu)[0].to_bytes()
    damage(copied.fmu, kind)
    result = invoke("export", copied.recipe, "--runs", copied.runs, "--json", "-")
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    assert str(copied.fmu) in figures["remark"]
    assert "neither report nor measured error" in figures["remark"]
    assert "remark: " in result.output
    assert read_fmu(copied.fmu)[0].to_bytes() == before
    assert read_member(copied.fmu, "documentation/index.html") is None
    again = invoke("export", copied.recipe, "--runs", copied.runs, "--json", "-")
    assert json.loads(again.stdout)["remark"] is None


@pytest.mark.extended
def test_export_to_another_place_says_so_too_and_leaves_the_damaged_fmu(
    copied: Finished, tmp_path: Path
) -> None:
    damage(copied.fmu, "half")
    before = copied.fmu.read_bytes()
    result = invoke("export", copied.recipe, "--runs", copied.runs, "-o", tmp_path / "x.fmu")
    assert result.exit_code == 0, result.output
    assert "neither report nor measured error" in result.output
    assert copied.fmu.read_bytes() == before
    read_fmu(tmp_path / "x.fmu")


@pytest.mark.extended
@pytest.mark.parametrize("kind", ["half", "empty"])
def test_run_writes_a_damaged_fmu_anew_with_its_report(copied: Finished, kind: str) -> None:
    damage(copied.fmu, kind)
    few = ("--trajectories", 1, "--workers", 1)
    result = invoke("run", copied.recipe, "--runs", copied.runs, *few)
    assert result.exit_code == 0, result.output
    assert "finished already; only the measuring is left to do." in result.output
    assert read_member(copied.fmu, "documentation/index.html") is not None


@pytest.mark.extended
@pytest.mark.parametrize("kind", essential(DAMAGES, "half"))
@pytest.mark.parametrize(
    "subcommand",
    [
        "validate",
        "check",
        "info",
        "export",
        of_app("bench", "bench"),
        of_app("ssp", "reference"),
    ],
)
def test_who_reads_a_damaged_fmu_names_it_and_the_remedy(
    copied: Finished, tmp_path: Path, subcommand: str, kind: str
) -> None:
    damage(copied.fmu, kind)
    more = ["-o", tmp_path / "x"] if subcommand in ("ssp", "export") else []
    result = invoke(subcommand, copied.fmu, *more)
    assert result.exit_code == 1
    assert isinstance(result.exception, SystemExit)  # no traceback
    (line,) = result.output.splitlines()
    assert f"{copied.fmu} is no FMU" in line
    assert line.endswith("get the file again, or write it anew (slide-fmu export)")
