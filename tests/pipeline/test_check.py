"""``check`` of files that are no FMUs, and what it says of one without problems."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.pipeline.check import check
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.libraries import build_libraries


def test_check_of_a_file_that_is_no_fmu_lists_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "linear.fmu"
    path.write_bytes(b"no archive")
    checked = check(path, run=True)
    assert len(checked.problems) == 1
    assert checked.parts == ()


@pytest.mark.parametrize("fmi", [2, 3])
def test_check_without_problems_says_what_was_checked(tmp_path: Path, fmi: FmiVersion) -> None:
    build_libraries()
    surrogate = random_surrogate(Shape(cell=CellShape()))
    path = export_fmu(surrogate, tmp_path / "tiny.fmu", fmi=fmi, sources=True)
    said = CliRunner().invoke(app, ["check", str(path)]).stderr
    assert "tiny.fmu: no problems. Checked:" in said
    words = ("hashes of all of them", f"valid for FMI {fmi}.0", "libraries for", "C sources: ")
    for part in (*words, "random steps agree with numpy", "Not checked: "):
        assert part in said, part
    assert "model card" not in said  # it has none
    assert any("but libraries and sources" in part for part in check(path, run=True).parts)
