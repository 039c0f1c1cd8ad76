"""``slide-fmu calibrate`` on the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv

from slide_fmu.apps.calibrate.command import PAIRINGS
from slide_fmu.core.readable import decimal
from slide_fmu.fmu.export import export_fmu
from slide_fmu.records.preparation import Pairing
from tests.acceptance.conftest import invoke
from tests.acceptance.test_base_install import TRAINING
from tests.apps.calibrate.records import TRUE, measured, surrogate_with
from tests.charts import charts_of
from tests.fmu.samples import STEP
from tests.limits import HANGS

THEN_TELL = """
import sys
from slide_fmu.cli.app import app
app(sys.argv[1:], standalone_mode=False)
print(*sys.modules)
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """An FMU with two parameters, and a noisy record of it."""
    folder, surrogate = tmp_path_factory.mktemp("files"), surrogate_with(2)
    inputs, outputs = measured(surrogate, TRUE, noise=0.01)
    answers = np.concatenate([outputs[:1], outputs[:-1]])  # held inputs: one sample later
    table = np.column_stack([STEP * np.arange(len(inputs)), inputs, answers])
    record = folder / "record.csv"
    np.savetxt(record, table, "%.9g", ",", header="time [s],force [N],y0 [m]", comments="")
    return export_fmu(surrogate, folder / "sample.fmu"), record


def test_calibrate_prints_values_and_writes_figures_and_parameters(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    ssv = tmp_path / "fitted.ssv"
    result = invoke("calibrate", *files, "--input", "u0=force", "--json", "-", "-o", ssv)
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    for row in figures["parameters"]:
        low, high = row["interval"]
        assert low < row["value"] < high
        assert row["value"] == pytest.approx(TRUE[row["name"]], abs=0.3)
        assert decimal(row["value"], 5) in result.stderr
    assert figures["outputs"][0]["after"] < 0.3 * figures["outputs"][0]["before"]
    assert "the surrogate's own error is not known" in result.stderr
    values = {row["name"]: row["value"] for row in figures["parameters"]}
    assert {p.name: float(p.value) for p in read_ssv(str(ssv)).parameters} == values


def test_fixed_parameter_is_held(files: tuple[Path, Path]) -> None:
    options = ("--input", "u0=force", "--fix", "damping=-0.7", "--json", "-")
    result = invoke("calibrate", *files, *options)
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    assert figures["fixed"] == {"damping": -0.7}
    assert [row["name"] for row in figures["parameters"]] == ["mass"]
    assert "damping was held at -0.7" in result.stderr


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--fix", "mass"), "--fix mass; expected NAME=VALUE, each name once"),
        (("--fix", "mass=heavy"), "--fix mass=heavy; expected a number behind ="),
        (("--fix", "mass=9"), "'mass' = 9.0 kg; expected a number in its range"),
        (("--input", "u0=a", "--input", "u0=b"), "--input u0=b; expected NAME=COLUMN"),
        ((), "has no columns ['u0']"),
        (("--input", "u0=force", "-o", "fitted.xml"), "expected a name ending in .ssv"),
    ],
)
def test_mistakes_are_refused_in_words(
    files: tuple[Path, Path], options: tuple[str, ...], message: str
) -> None:
    result = invoke("calibrate", *files, *options)
    assert result.exit_code == 1
    assert message in result.stderr.replace("\n", " ")


@pytest.mark.extended
def test_calibrate_imports_no_training_packages(files: tuple[Path, Path]) -> None:
    """scipy takes packages that are made missing, as other tests do, for broken ones."""
    arguments = [str(file) for file in files]
    command = [sys.executable, "-c", THEN_TELL, "calibrate", *arguments, "--input", "u0=force"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=HANGS)
    assert result.returncode == 0, result.stderr
    assert not set(TRAINING) & set(result.stdout.split())


def test_pairing_of_another_name_is_refused_with_both() -> None:
    assert get_args(Pairing) == PAIRINGS
    result = invoke("calibrate", "x.fmu", "a.csv", "--pairing", "none")
    assert result.exit_code == 2
    assert (
        "'none'; expected same or later: correct it, or leave the option out, and the"
        in result.output
    )


def test_report_shows_parameters_and_the_record(files: tuple[Path, Path], tmp_path: Path) -> None:
    result = invoke("calibrate", *files, "--input", "u0=force", "--report", tmp_path)
    assert result.exit_code == 0, result.output
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    figures = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    for row in figures["parameters"]:
        assert f"<dt>{row['name']}</dt>" in page
        assert decimal(row["value"], 5) in page
    (chart,) = charts_of(page)["charts"]
    names = [line["name"] for line in chart["panels"][0]["lines"]]
    assert names == ["record", "before", "fitted"]
