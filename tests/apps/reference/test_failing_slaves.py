"""Exceptions of a model leave the interpreter of its importer intact."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

MODEL = """
inputs = {"place": {"unit": "m", "range": [-1.0, 1.0]}}
outputs = {"force": {"unit": "N", "range": [-1e3, 1e3]}}
start = [0.0]


def f(x, u, p):
    return [-x[0]]


def g(x, u, p):
    if u[0] > 0.5:
        raise ZeroDivisionError("no")
    return [-100.0 * u[0]]
"""
IMPORTER = """
import gc, sys
from pathlib import Path
import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.systems.specification import Specification

folder = Path(sys.argv[1])
made = Specification(str(folder / "spring.py"), {}, 0.01, "function", {})
fmu = str(write_reference_fmu(made, folder / "spring.fmu"))
description, unzipped = fmpy.read_model_description(fmu), fmpy.extract(fmu)
names = {v.name: v.valueReference for v in description.modelVariables}
refused = 0
for _ in range(3):
    one = FMU2Slave(
        guid=description.guid, unzipDirectory=unzipped, instanceName="one",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    one.instantiate()
    one.setupExperiment(startTime=0)
    one.enterInitializationMode()
    one.setReal([names["place"]], [0.9])
    for _ in range(4):
        try:
            one.getReal([names["force"]])
        except FMICallException:
            refused += 1
    one.freeInstance()
    gc.collect()
print("refused", refused)
"""


@pytest.mark.extended
def test_each_exception_is_an_error_and_nothing_is_freed_twice(tmp_path: Path) -> None:
    (tmp_path / "spring.py").write_text(MODEL, encoding="utf-8")
    command = [sys.executable, "-c", IMPORTER, str(tmp_path)]
    # freed memory is overwritten, so that its use ends the process
    environment = {**os.environ, "PYTHONMALLOC": "debug"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert "refused 12" in done.stdout
