"""An FMU of recorded inputs gives sample k from time k h on."""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from slide_fmu.apps.reference.input_source import write_input_source
from slide_fmu.core.signals import FloatArray, Signal

SIGNALS = (Signal("force", "N", 0.0, 1000.0), Signal("angle", "rad", -3.0, 3.0))


def played(path: Path, steps: list[float], start: float = 0.0) -> FloatArray:
    """Outputs at the start and after every step, shape (steps + 1, 2)."""
    description = fmpy.read_model_description(str(path))
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="test",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=start)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    rows, time = [slave.getReal([0, 1])], start
    for step in steps:
        slave.doStep(time, step)
        time += step
        rows.append(slave.getReal([0, 1]))
    slave.freeInstance()
    return np.array(rows)


def record(samples: int) -> FloatArray:
    """The number of the sample, and a fraction of it."""
    return np.arange(samples)[:, None] * np.array([1.0, 1e-3])


@pytest.mark.parametrize("step", [1 / 30, 1e-9 * round(1e9 / 30)], ids=["exact", "nanoseconds"])
def test_whole_steps_are_counted(step: float, tmp_path: Path) -> None:
    path = write_input_source(SIGNALS, 1 / 30, record(300), tmp_path / "inputs.fmu")
    assert validate_fmu(str(path)) == []
    np.testing.assert_array_equal(played(path, [step] * 299), record(300))


def test_other_steps_and_starts_and_the_end(tmp_path: Path) -> None:
    path = write_input_source(SIGNALS, 0.1, record(5), tmp_path / "inputs.fmu")
    samples = played(path, [0.05] * 5, start=0.2)[:, 0]
    assert samples.tolist() == [2, 2, 3, 3, 4, 4]
    assert played(path, [0.3, 0.3])[:, 0].tolist() == [0, 3, 4]
