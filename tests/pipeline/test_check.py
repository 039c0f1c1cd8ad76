"""``check`` of files that are no FMUs."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.pipeline.check import check


def test_check_of_a_file_that_is_no_fmu_lists_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "linear.fmu"
    path.write_bytes(b"no archive")
    assert len(check(path, run=True).problems) == 1
