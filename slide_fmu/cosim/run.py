"""FMUs are run step by step with fmpy."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.unpacking import UnpackingError, unpack
from slide_fmu.cosim.importer import ImportedSlave, ValueReader, open_slave, read_description
from slide_fmu.fmu.export import REMEDY


class CoSimulationError(RuntimeError):
    """An FMU could not be run, or reports an error."""


@dataclass(frozen=True, eq=False)
class UnpackedFmu:
    """An UnpackedFmu is ready to be instantiated.

    Attributes:
        path: the file it was unpacked from.
        folder: folder with its files.
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
        """The communication step in s in the FMU's DefaultExperiment."""
        return float(self.description.defaultExperiment.stepSize)

    def require(self, *names: str) -> None:
        """Raise a CoSimulationError, with all names, for variables that the FMU does not have."""
        unknown = [name for name in names if name not in self.references]
        if unknown:
            raise CoSimulationError(
                f"{self.path.name} has no variables {unknown}; it has {sorted(self.references)}"
            )


@dataclass(frozen=True, eq=False)
class Run:
    """A Run is the result of running an FMU.

    Attributes:
        values: outputs at t_0 .. t_N in their units, shape (N + 1, n_outputs); Booleans are 0 or
            1.
        seconds: wall time in s of set, doStep and get of every step, shape (N,).
        step_seconds: wall time in s of doStep only, shape (N,).
    """

    values: FloatArray
    seconds: FloatArray
    step_seconds: FloatArray


@contextmanager
def unpacked(path: Path) -> Iterator[UnpackedFmu]:
    """Unpack an FMU for the time of a ``with`` block.

    Raises:
        CoSimulationError: the file cannot be unpacked, or is not a co-simulation FMU of FMI 2.0 or
            FMI 3.0.
        FullDiskError: there is no space for its files.
        FmuError: the file is not an FMU, or its model description cannot be read.
    """
    description = read_description(path, validate=False)
    # a library that a process has loaded cannot be removed everywhere
    with TemporaryDirectory(prefix="slide_fmu_", ignore_cleanup_errors=True) as folder:
        try:
            unpack(path, folder)
        except UnpackingError as error:
            raise CoSimulationError(f"{path} cannot be unpacked: {error}; {REMEDY}") from error
        known = description.fmiVersion[:2] in ("2.", "3.")
        if not known or description.coSimulation is None:
            raise CoSimulationError(
                f"{path}: FMI {description.fmiVersion}; expected a co-simulation FMU of FMI 2.0 "
                "or 3.0"
            )
        variables = description.modelVariables
        yield UnpackedFmu(
            path,
            folder,
            description,
            {variable.name: variable.valueReference for variable in variables},
            {variable.name: variable.type for variable in variables},
        )


@contextmanager
def instantiated(fmu: UnpackedFmu) -> Iterator[ImportedSlave]:
    """Open a fresh instance of an FMU for the time of a ``with`` block.

    Raises:
        CoSimulationError: its library cannot be loaded, or a call in the block failed; the message
            has the FMU's log.
    """
    from fmpy.fmi1 import FMICallException

    messages: list[str] = []

    def failed(error: Exception) -> CoSimulationError:
        return CoSimulationError(f"{fmu.path.name}: {'; '.join(messages) or error}")

    with ExitStack() as stack:
        slave = open_slave(fmu.folder, fmu.description, fmu.path.stem, messages)
        try:
            opened = stack.enter_context(slave)
        except Exception as error:  # fmpy raises bare Exception when a library cannot be loaded
            raise failed(error) from error
        try:
            yield opened
        except FMICallException as error:
            raise failed(error) from error


def run_fmu(
    fmu: UnpackedFmu,
    inputs: Mapping[str, FloatArray],
    outputs: Sequence[str],
    parameters: Mapping[str, float | bool] | None = None,
    step: float | None = None,
) -> Run:
    """Run a fresh instance of an FMU; inputs have a zero-order hold over each step.

    Args:
        fmu: the unpacked FMU.
        inputs: values by variable name, shape (N,) each; ``inputs[name][k]`` is set before the
            step from t_k to t_k+1, the first also in initialization mode.
        outputs: names of the variables to record.
        parameters: real or boolean values set before initialization.
        step: communication step in s; the FMU's own if not given.

    Raises:
        CoSimulationError: a variable does not exist, or the FMU reports an error.
    """
    parameters, step = parameters or {}, step or fmu.step
    fmu.require(*inputs, *outputs, *parameters)
    references = [fmu.references[name] for name in inputs]
    read = ValueReader([fmu.references[name] for name in outputs], [fmu.types[n] for n in outputs])
    rows = np.stack(list(inputs.values()), axis=1).tolist()
    with instantiated(fmu) as slave:
        for name, value in parameters.items():
            if fmu.types[name] == "Boolean":
                slave.set_boolean([fmu.references[name]], [bool(value)])
            else:
                slave.set_real([fmu.references[name]], [float(value)])
        slave.set_real(references, rows[0])
        slave.enter_initialization(0.0)
        slave.set_real(references, rows[0])
        slave.exit_initialization()
        values, seconds, step_seconds = [read(slave)], np.empty(len(rows)), np.empty(len(rows))
        for k, row in enumerate(rows):
            begin = time.perf_counter()
            slave.set_real(references, row)
            before = time.perf_counter()
            slave.do_step(k * step, step)
            step_seconds[k] = time.perf_counter() - before
            values.append(read(slave))
            seconds[k] = time.perf_counter() - begin
        slave.terminate()
    return Run(np.array(values, dtype=np.float64), seconds, step_seconds)
