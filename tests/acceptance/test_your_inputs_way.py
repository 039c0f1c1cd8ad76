"""The whole way with a file of the user's own inputs, which ``run`` adds to a recipe."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data.trajectories import Trajectories
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.validation.row import YOURS
from tests.acceptance.conftest import SMALL_BOUNDED, invoke
from tests.libraries import build_libraries

HALF = f"{YOURS}: second half of drive.csv"


def write_drive(folder: Path) -> Path:
    """A drive of 24 s at 10 ms: ramps and rests with a ripple, larger in its second half."""
    times = 0.01 * np.arange(2401)
    at = [0, 2, 3, 6, 8, 12, 15, 16, 20, 22, 24]
    levels = [0, 0, 500, 500, -300, 200, 0, -700, -700, 800, 800]
    force = np.interp(times, at, levels) + 40.0 * np.sin(9.0 * times)
    path = folder / "drive.csv"
    rows = np.stack([times, force], axis=1)
    np.savetxt(path, rows, "%.6g", ",", header="time,force [N]", comments="")
    return path


@pytest.mark.extended
def test_second_half_is_never_learnt_and_judges_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build_libraries()
    drive, recipe = write_drive(tmp_path), tmp_path / "small_bounded.toml"
    recipe.write_text(SMALL_BOUNDED, encoding="utf-8")
    runs = tmp_path / "runs"
    result = invoke(
        "run", recipe, "--inputs", drive, "--runs", runs, "--workers", 1, "--json", "-"
    )
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    assert figures["command"] == "slide-fmu run small_bounded.toml --inputs drive.csv"
    yours = [row for row in figures["rows"] if row["group"] == YOURS]
    assert [(row["call"], row["steps"]) for row in yours] == [("plain", 1.0), ("plain", 4.0)]
    assert yours[0]["inputs"] == "second half of drive.csv"
    assert yours[0]["samples"] == yours[0]["counted"] == pytest.approx(12.0 * 64, abs=1)
    assert yours[0]["outputs"][0]["relative_rmse"] < 0.05
    assert " under your inputs (second half of drive.csv) at a communication " in result.stderr
    assert recipe.read_text(encoding="utf-8") == SMALL_BOUNDED  # only this run has the file

    fmu, card = runs / "small_bounded" / "small_bounded.fmu", runs / "small_bounded" / "card.md"
    monkeypatch.setenv("COLUMNS", "200")
    shown = invoke("info", fmu)
    for text in (shown.output, card.read_text(encoding="utf-8")):
        lines = [line for line in text.splitlines() if HALF in line or "in range" in line]
        assert HALF in lines[0]  # the first row of the table

    known = recipe_of_provenance(read_fmu(fmu)[1], "fmu")
    case = case_of(known)
    trajectories = Trajectories.of(case, runs / "small_bounded" / "trajectories")
    place = len(known.data.excitation) - 1
    learnt = np.loadtxt(drive, delimiter=",", skiprows=1)[: 1 + 1200, 1]
    for split in ("calibration", "train", "bound"):
        kept = trajectories.read(split)
        of_file = kept.inputs[kept.kinds == place]
        assert len(of_file) or split == "train"
        assert np.ptp([*learnt, *of_file.ravel()]) == pytest.approx(np.ptp(learnt))

    again = invoke("validate", fmu, "--inputs", drive, "--json", "-")
    assert again.exit_code == 0, again.output
    measured = json.loads(again.stdout)
    assert (measured["begin_s"], measured["end_s"]) == (12.0, 24.0)
    assert measured["remark"] == "the FMU has learnt from the rest of drive.csv"
    for before, now in zip(yours, measured["rows"], strict=True):
        assert now["outputs"][0]["rmse"] == pytest.approx(before["outputs"][0]["rmse"], rel=1e-6)
        assert now["outputs"][0]["covered"] == before["outputs"][0]["covered"]
        assert now["trusted"] == before["trusted"]
