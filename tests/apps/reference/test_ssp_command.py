"""``slide-fmu ssp`` on the command line: what it writes for the FMU of a finished run."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from fmpy.ssp.ssd import read_ssd

from slide_fmu.cosim.check import check_fmu
from tests.acceptance.conftest import Finished, invoke
from tests.acceptance.importers import run_fmpy

STEP, DURATION = 0.015625, 2.0
ERROR = 0.01
"""Relative RMSE of a small training; if one of both were a step late it would be 0.58."""


def test_ssp_of_a_finished_run_shows_surrogate_and_reference_side_by_side(
    bounded: Finished, tmp_path: Path
) -> None:
    ssp = tmp_path / "beside.ssp"
    result = invoke("ssp", bounded.fmu, "-o", ssp, "--duration", DURATION)
    assert result.exit_code == 0, result.output
    assert str(ssp) in result.output
    system = read_ssd(str(ssp)).system
    names = [element.name for element in system.elements]
    assert names == ["inputs", "reference", "surrogate"]
    connected = {(line.startElement, line.endElement) for line in system.connections}
    assert connected == {("inputs", "reference"), ("inputs", "surrogate")}
    with zipfile.ZipFile(ssp) as archive:
        inside = archive.extract("resources/surrogate.fmu", tmp_path)
    assert Path(inside).read_bytes() == bounded.fmu.read_bytes()
    assert check_fmu(Path(inside)) == []
    outputs = [("inputs", "force"), ("reference", "position"), ("surrogate", "position")]
    force, reference, surrogate = run_fmpy(ssp, outputs, STEP, round(DURATION / STEP)).T
    assert np.ptp(force) > 100  # N
    assert np.sqrt(np.mean((surrogate - reference) ** 2) / np.mean(reference**2)) < ERROR
