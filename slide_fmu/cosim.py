"""Run FMUs step by step with fmpy: one alone, or two side by side on the same inputs."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy import fmi2

from slide_fmu.signals import FloatArray


class CoSimulationError(RuntimeError):
    """An FMU could not be run."""


@dataclass(frozen=True, eq=False)
class UnpackedFmu:
    """An FMU that is ready to be instantiated.

    Attributes:
        path: the file it was unpacked from.
        folder: where it was unpacked to.
        description: fmpy's model description.
        references: value reference of every variable.
        types: FMI type name of every variable.
    """

    path: Path
    folder: str
    description: Any
    references: Mapping[str, int]
    types: Mapping[str, str]

    @property
    def step(self) -> float:
        """Communication step in s that the FMU asks for (DefaultExperiment)."""
        return float(self.description.defaultExperiment.stepSize)


@dataclass(frozen=True, eq=False)
class Run:
    """Result of one run.

    Attributes:
        values: outputs at t_0 .. t_N, shape (N + 1, n_outputs).
        seconds: wall time of set, doStep and get of every step, shape (N,).
    """

    values: FloatArray
    seconds: FloatArray


@contextmanager
def unpacked(path: Path) -> Iterator[UnpackedFmu]:
    """Unpack an FMU for the time of a ``with`` block.

    Raises:
        CoSimulationError: the file is no FMI 2.0 co-simulation FMU.
    """
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        folder = fmpy.extract(str(path))
    except Exception as error:
        raise CoSimulationError(f"{path} is not an FMU that can be read: {error}") from error
    try:
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            raise CoSimulationError(
                f"{path}: FMI {description.fmiVersion}; expected an FMI 2.0 co-simulation FMU"
            )
        variables = description.modelVariables
        yield UnpackedFmu(
            path,
            folder,
            description,
            {variable.name: variable.valueReference for variable in variables},
            {variable.name: variable.type for variable in variables},
        )
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def run_fmu(
    fmu: UnpackedFmu,
    inputs: Mapping[str, FloatArray],
    outputs: Sequence[str],
    parameters: Mapping[str, float | bool] | None = None,
    step: float | None = None,
) -> Run:
    """Run a fresh instance of an FMU; inputs are held over each communication step.

    Args:
        inputs: values by variable name, shape (N,) each; ``inputs[name][k]`` is set before the
            step from t_k to t_k+1, the first also in initialization mode.
        outputs: names of the variables to record.
        parameters: real or boolean values set before initialization.
        step: communication step in s; the FMU's own if not given.

    Raises:
        CoSimulationError: a variable is not there, or the FMU reports an error.
    """
    unknown = [n for n in (*inputs, *outputs, *(parameters or {})) if n not in fmu.references]
    if unknown:
        raise CoSimulationError(
            f"{fmu.path.name} has no variables {unknown}; it has {sorted(fmu.references)}"
        )
    slave = fmi2.FMU2Slave(
        guid=fmu.description.guid,
        unzipDirectory=fmu.folder,
        modelIdentifier=fmu.description.coSimulation.modelIdentifier,
        instanceName=fmu.path.stem,
    )
    messages: list[str] = []
    try:
        slave.instantiate(callbacks=_collecting_callbacks(messages))
        try:
            return _run(slave, fmu, inputs, outputs, parameters or {}, step or fmu.step)
        finally:
            slave.freeInstance()
    except Exception as error:
        said = "; ".join(messages) or str(error)
        raise CoSimulationError(f"{fmu.path.name}: {said}") from error


def _run(
    slave: Any,
    fmu: UnpackedFmu,
    inputs: Mapping[str, FloatArray],
    outputs: Sequence[str],
    parameters: Mapping[str, float | bool],
    step: float,
) -> Run:
    slave.setupExperiment(startTime=0.0)
    for name, value in parameters.items():
        if fmu.types[name] == "Boolean":
            slave.setBoolean([fmu.references[name]], [bool(value)])
        else:
            slave.setReal([fmu.references[name]], [float(value)])
    input_references = [fmu.references[name] for name in inputs]
    output_references = [fmu.references[name] for name in outputs]
    rows = np.stack(list(inputs.values()), axis=1).tolist()
    slave.setReal(input_references, rows[0])
    slave.enterInitializationMode()
    slave.setReal(input_references, rows[0])
    slave.exitInitializationMode()
    values = [slave.getReal(output_references)]
    seconds = np.empty(len(rows))
    for k, row in enumerate(rows):
        begin = time.perf_counter()
        slave.setReal(input_references, row)
        slave.doStep(k * step, step)
        values.append(slave.getReal(output_references))
        seconds[k] = time.perf_counter() - begin
    slave.terminate()
    return Run(np.array(values, dtype=np.float64), seconds)


def _collecting_callbacks(messages: list[str]) -> Any:
    """FMI callbacks that keep what the FMU logs as warning or worse.

    fmpy's own proxy for printf-like messages is left alone: it serves one logger per process, and
    would outlive this one. Messages without arguments need it only for their doubled signs.
    """

    def log(_environment: Any, _name: Any, status: int, _category: Any, message: Any) -> None:
        if status > fmi2.fmi2OK and message:
            messages.append(message.decode("utf-8", "replace").replace("%%", "%"))

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return callbacks
