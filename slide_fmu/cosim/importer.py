"""FMUs of FMI 2.0 or FMI 3.0 are read and instantiated through fmpy."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from slide_fmu.core.zip_directory import open_archive
from slide_fmu.fmu.export import FmuError

if TYPE_CHECKING:  # fmpy is of the extra "run": who only imports this module needs none
    from fmpy.model_description import ModelDescription


def read_description(path: Path, validate: bool = True) -> ModelDescription:
    """Read the model description of an FMU, by any tool.

    Args:
        path: the FMU file.
        validate: also refuse files that violate the standard's schema.

    Raises:
        FmuError: the file is not an FMU, or is one of FMI 1.0, or its model description cannot be
            read.
    """
    import fmpy

    try:
        with path.open("rb") as file:  # fmpy does not close a file that it cannot read
            return fmpy.read_model_description(file, validate=validate)
    except Exception as error:  # fmpy raises bare Exception, lxml a SyntaxError, dicts a KeyError
        if _is_of_fmi_1(path):
            raise FmuError(
                f"{path} is of FMI 1.0; expected FMI 2.0 or 3.0: export it again"
            ) from None
        raise FmuError(
            f"{path} is not an FMU that can be read: {error}; expected an FMU: replace it"
        ) from error


def _is_of_fmi_1(path: Path) -> bool:
    """Return whether an FMU that fmpy cannot read is of FMI 1.0."""
    try:
        with open_archive(path) as archive:
            found = re.search(rb'fmiVersion\s*=\s*"1\.', archive.read("modelDescription.xml"))
    except (OSError, KeyError, zipfile.BadZipFile):
        return False
    return found is not None


@final
class ImportedSlave:
    """An ImportedSlave is an instance of an FMU; both standards have the same calls.

    A call that fails raises fmpy's ``FMICallException``. Times are in s; real variables have the
    type Real (Float64 in FMI 3.0).

    Attributes:
        calls: fmpy's instance, which has all calls of its standard.

    Args:
        slave: fmpy's instance, of ``FMU2Slave`` or ``FMU3Slave``.
    """

    def __init__(self, slave: Any) -> None:
        from fmpy import fmi3

        self.calls = slave
        self.fmi_3 = isinstance(slave, fmi3.FMU3Slave)
        self.exit_initialization: Callable[[], None] = slave.exitInitializationMode
        self.do_step: Callable[[float, float], None] = slave.doStep
        self.terminate: Callable[[], None] = slave.terminate
        self.get_state: Callable[[], object] = slave.getFMUState
        self.set_state: Callable[[object], None] = slave.setFMUState
        self.free_state: Callable[[object], None] = slave.freeFMUState
        self.set_boolean: Callable[[Sequence[int], Sequence[bool]], None] = slave.setBoolean
        self.get_boolean: Callable[[Sequence[int]], list[bool]] = slave.getBoolean
        real = "Float64" if self.fmi_3 else "Real"
        self.set_real: Callable[[Sequence[int], Sequence[float]], None]
        self.set_real = getattr(slave, f"set{real}")
        self.get_real: Callable[[Sequence[int]], list[float]] = getattr(slave, f"get{real}")

    def enter_initialization(self, start_time: float) -> None:
        """Begin initialization mode at a start time in s."""
        if self.fmi_3:
            self.calls.enterInitializationMode(startTime=start_time)
        else:
            self.calls.setupExperiment(startTime=start_time)
            self.calls.enterInitializationMode()


@final
class ValueReader:
    """A ValueReader gets variables of types Real (Float64) and Boolean, in one order.

    Args:
        references: value references of the variables.
        types: names of their types, as in the model description.
    """

    def __init__(self, references: Sequence[int], types: Sequence[str]) -> None:
        self._boolean = [name == "Boolean" for name in types]
        kinds = list(zip(references, self._boolean, strict=True))
        self._reals = [reference for reference, boolean in kinds if not boolean]
        self._booleans = [reference for reference, boolean in kinds if boolean]

    def __call__(self, slave: ImportedSlave) -> list[float]:
        """Return the values in the order of the references; a Boolean is 0 or 1."""
        if not self._booleans:  # only the call, since its time is measured
            return slave.get_real(self._reals)
        reals = iter(slave.get_real(self._reals) if self._reals else [])
        booleans = map(float, slave.get_boolean(self._booleans))
        return [next(booleans if boolean else reals) for boolean in self._boolean]


@contextmanager
def open_slave(
    folder: str, description: ModelDescription, name: str, messages: list[str]
) -> Iterator[ImportedSlave]:
    """Instantiate an unpacked FMU for the time of a ``with`` block.

    Args:
        folder: the folder of the unpacked FMU.
        description: its model description, of FMI 2.0 or FMI 3.0.
        name: the name of the instance.
        messages: receives the warnings and errors that the FMU logs.

    Raises:
        Exception: fmpy raises it when the library cannot be loaded or rejects the instance.
    """
    from fmpy import fmi2, fmi3

    from slide_fmu.systems.fmu.instance import callbacks_of_fmi2, logger

    arguments = {
        "guid": description.guid or description.instantiationToken,
        "unzipDirectory": folder,
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "instanceName": name,
    }
    with chdir(Path.cwd()):  # fmpy stays in its folder when loading fails
        if description.fmiVersion.startswith("3."):
            slave = fmi3.FMU3Slave(**arguments)
            slave.instantiate(logMessage=logger(messages))
        else:
            slave = fmi2.FMU2Slave(**arguments)
            slave.instantiate(callbacks=callbacks_of_fmi2(messages))
    try:
        yield ImportedSlave(slave)
    finally:
        slave.freeInstance()
