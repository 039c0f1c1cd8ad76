"""Calls that an FMU with a torch module refuses, and what it keeps then."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from slide_fmu.core.signals import Hold
from slide_fmu.python_fmu.torch_export import export_module
from tests.fmu.samples import STEP
from tests.python_fmu.modules import (
    EVERYTHING,
    IN_RANGE,
    PARAMETERS,
    RESULTS,
    saved,
    start,
    surrogate_with,
)


@pytest.mark.parametrize(
    ("time", "step", "inputs", "message"),
    [
        (0.0, 0.0, [0, 0], "expected a positive, finite step"),
        (0.0, -STEP, [0, 0], "expected a positive, finite step"),
        (0.0, np.inf, [0, 0], "expected a positive, finite step"),
        (STEP, STEP, [0, 0], "the end of the last step"),
        (0.0, STEP, [np.nan, 0], "expected a finite number"),
    ],
)
def test_step_that_cannot_be_taken_is_refused(
    time: float,
    step: float,
    inputs: list[float],
    message: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = export_module(*saved(surrogate_with("zero_order"), tmp_path, ".pt"), tmp_path / "m.fmu")
    slave = start(path, tmp_path / "a")
    slave.setReal([0, 1], inputs)
    with pytest.raises(FMICallException):
        slave.doStep(time, step)
    assert message in capfd.readouterr().out
    slave.setReal([0, 1], [0.0, 0.0])
    slave.doStep(0.0, STEP)
    slave.freeInstance()


def test_value_that_cannot_be_set_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = export_module(*saved(surrogate_with("zero_order"), tmp_path, ".pt"), tmp_path / "m.fmu")
    slave = start(path, tmp_path / "a", 1.0, 0.3, -0.4)
    before, everything = slave.getReal(EVERYTHING), EVERYTHING
    for references, values, message in (
        ([0, PARAMETERS[0]], [0.5, 0.0], f"{PARAMETERS[0]} is a parameter; set it before"),
        ([0, PARAMETERS[1]], [0.5, 0.0], f"{PARAMETERS[1]} is a parameter; set it before"),
        ([0, RESULTS[0]], [0.5, 0.0], f"{RESULTS[0]} is no input; only inputs, 0 to 1, and"),
        ([0, 1], [0.5, 1e300], "1 = 1e+300; expected a finite number near the input's range"),
    ):
        slave.setReal(references, values)  # PythonFMU has no status for it
        assert message in capfd.readouterr().out
        assert slave.getReal(everything) == before
        with pytest.raises(FMICallException):
            slave.doStep(0.0, STEP)
        assert message in capfd.readouterr().out
        assert slave.getReal(everything) == before
    assert np.isnan(slave.getReal([9])[0])
    assert "value reference 9 is no variable of type Real" in capfd.readouterr().out
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    slave.doStep(0.0, STEP)
    slave.freeInstance()


@pytest.mark.parametrize("reference", [IN_RANGE, 0])
def test_booleans_cannot_be_set_and_the_instance_lives_on(
    reference: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = export_module(*saved(surrogate_with("zero_order"), tmp_path, ".pt"), tmp_path / "m.fmu")
    slave = start(path, tmp_path / "a", 1.0, 0.3, -0.4)
    before = slave.getReal(EVERYTHING), slave.getBoolean([IN_RANGE])
    slave.setBoolean([reference], [False])
    message = f"value reference {reference} is no Boolean variable that can be set"
    assert message in capfd.readouterr().out
    assert (slave.getReal(EVERYTHING), slave.getBoolean([IN_RANGE])) == before
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    slave.doStep(0.0, STEP)
    slave.freeInstance()


def test_state_that_is_damaged_or_of_another_fmu_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    paths = []
    for hold in get_args(Hold):
        (tmp_path / hold).mkdir()
        files = saved(surrogate_with(hold), tmp_path / hold, ".pt")
        paths.append(export_module(*files, tmp_path / hold / "m.fmu"))
    slave, other = (start(path, path.parent / "a") for path in paths)
    slave.doStep(0.0, STEP)
    before = slave.getReal(EVERYTHING)
    foreign = other.serializeFMUstate(other.getFMUstate())
    damaged = bytearray(slave.serializeFMUstate(slave.getFMUstate()))
    damaged[len(damaged) // 2] ^= 1
    for data, message in (
        (foreign, "the state belongs to another FMU"),
        (bytes(damaged), "the state is damaged"),
        (b"", "the state is damaged"),
    ):
        slave.setFMUstate(slave.deSerializeFMUstate(data))
        assert message in capfd.readouterr().out
        assert slave.getReal(EVERYTHING) == before
        with pytest.raises(FMICallException):
            slave.doStep(STEP, STEP)
    slave.doStep(STEP, STEP)
    for instance in (slave, other):
        instance.freeInstance()
