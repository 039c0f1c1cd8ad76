"""A released FMU runs along a file of inputs, alone and next to its model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from tests.libraries import build_libraries

FMU = Path(__file__).parents[2] / "fmus" / "duffing_10ms" / "duffing_10ms.fmu"
START = 100.0
"""Time in s of the first sample in the file."""


@pytest.fixture(autouse=True)
def _libraries() -> None:
    build_libraries()


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def written(folder: Path, beyond: bool) -> Path:
    """A drive of 12 s at 8 ms; beyond the range of 1000 N from 6 to 7 s, if asked for."""
    times = 0.008 * np.arange(1501)
    force = 400.0 * np.sin(0.9 * times) + 200.0 * np.clip(3 * np.sin(0.4 * times), -1, 1)
    force[(times >= 6.0) & (times <= 7.0) & beyond] = 1500.0
    path = folder / "drive.csv"
    rows = np.stack([START + times, force], axis=1)
    np.savetxt(path, rows, delimiter=",", header="t,force", comments="", fmt="%.9g")
    return path


def test_an_fmu_says_alone_where_and_why_it_does_not_trust(tmp_path: Path) -> None:
    file, out = written(tmp_path, beyond=True), tmp_path / "out.csv"
    result = invoke("simulate", FMU, "--inputs", file, "-o", out, "--json", "-")
    assert result.exit_code == 0, result.output
    view = json.loads(result.stdout)
    assert (view["call"], view["step_s"], view["samples"]) == ("plain", 0.01, 1200)
    assert view["out_of_range"] == ["force reaches 1500, beyond -1000 .. 1000 N"]
    part = max(view["parts"], key=lambda one: one["samples"])
    assert part["begin_s"] == pytest.approx(START + 6.0, abs=0.05)
    assert part["end_s"] > START + 7.0
    assert part["why"][0] == "inputs were out of their ranges"
    assert view["first_s"] > START
    assert "Input force reaches 1500" in result.stderr
    table = np.genfromtxt(out, delimiter=",", names=True)
    assert table["time"][[0, -1]].tolist() == [START, START + 12.0]
    counted = table["error_bound_filled"] >= 1
    assert view["counted"] == np.count_nonzero(counted[1:])
    share = np.mean(table["trusted"][counted] == 0)
    assert view["not_trusted"] == pytest.approx(share, abs=1e-3)
    assert sum(one["samples"] for one in view["parts"]) == np.count_nonzero(
        (table["trusted"] == 0) & counted
    )


def test_an_fmu_is_measured_under_a_file_and_other_options_are_refused(tmp_path: Path) -> None:
    file = written(tmp_path, beyond=False)
    result = invoke("validate", FMU, "--inputs", file, "--json", "-")
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    assert (figures["inputs"], figures["judging"]) == ("drive.csv", "drive.csv")
    assert (figures["begin_s"], figures["end_s"]) == pytest.approx((START, START + 12.0))
    rows = {(row["call"], row["steps"]): row for row in figures["rows"]}
    assert set(rows) == {("plain", 1.0), ("plain", 4.0)}  # its input is held
    assert rows["plain", 1.0]["counted"] == rows["plain", 1.0]["samples"]
    for row in rows.values():
        assert row["outputs"][0]["relative_rmse"] < 0.002
        assert row["outputs"][0]["covered"] > 0.95
        assert row["trusted"] > 0.9
    assert " under your inputs (drive.csv) at a communication step of 10 ms" in result.stderr
    refused = invoke("validate", FMU, "--inputs", file, "--trajectories", 3)
    assert refused.exit_code == 1
    assert "leave them out" in refused.output


def test_a_file_beyond_the_range_is_not_measured(tmp_path: Path) -> None:
    result = invoke("validate", FMU, "--inputs", written(tmp_path, beyond=True))
    assert result.exit_code == 1
    for words in ("'force' = 1500 N", "-1000 .. 1000 N", "correct the file"):
        assert words in result.output
