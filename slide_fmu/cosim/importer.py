"""One instance of a co-simulation FMU, of FMI 2.0 or FMI 3.0, through fmpy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Any, Protocol

import fmpy
from fmpy import fmi2, fmi3
from fmpy.model_description import ModelDescription


class Slave(Protocol):
    """What both standards offer under one name; a call that fails raises fmpy's exception."""

    def enter_initialization(self, start_time: float) -> None: ...
    def exit_initialization(self) -> None: ...
    def set_real(self, references: Sequence[int], values: Sequence[float]) -> None: ...
    def set_boolean(self, references: Sequence[int], values: Sequence[bool]) -> None: ...
    def get_real(self, references: Sequence[int]) -> list[float]: ...
    def get_boolean(self, references: Sequence[int]) -> list[bool]: ...
    def do_step(self, time: float, step: float) -> None: ...
    def terminate(self) -> None: ...


class Reader:
    """Reads variables of types Real (Float64) and Boolean, in one order.

    Args:
        references: value references.
        types: names of their types, as in the model description.
    """

    def __init__(self, references: Sequence[int], types: Sequence[str]) -> None:
        self._places: dict[bool, list[int]] = {False: [], True: []}
        for place, name in enumerate(types):
            self._places[name == "Boolean"].append(place)
        self._references = {
            boolean: [references[place] for place in places]
            for boolean, places in self._places.items()
        }
        self._count = len(references)

    def __call__(self, slave: Slave) -> list[float]:
        """Values in the order of the references; of a Boolean 0 or 1."""
        if not self._places[True]:  # nothing but the call: its time is measured
            return slave.get_real(self._references[False])
        values = [0.0] * self._count
        for boolean, places in self._places.items():
            get = slave.get_boolean if boolean else slave.get_real
            found = get(self._references[boolean]) if places else []
            for place, value in zip(places, found, strict=True):
                values[place] = float(value)
        return values


@contextmanager
def open_slave(
    folder: str, description: ModelDescription, name: str, messages: list[str]
) -> Iterator[Slave]:
    """Instantiate an unpacked FMU for the time of a ``with`` block.

    Args:
        folder: the unpacked FMU.
        name: of the instance.
        messages: receives what the FMU logs as warning or worse.

    Raises:
        Exception: what fmpy raises when the library cannot be loaded or refuses.
    """
    arguments = {
        "guid": description.guid or description.instantiationToken,
        "unzipDirectory": folder,
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "instanceName": name,
    }
    with chdir(Path.cwd()):  # fmpy stays in its folder when loading fails
        if description.fmiVersion.startswith("3."):
            slave = fmi3.FMU3Slave(**arguments)
            slave.instantiate(logMessage=_logger3(messages))
            opened: Slave = _Slave3(slave)
        else:
            slave = fmi2.FMU2Slave(**arguments)
            slave.instantiate(callbacks=_callbacks2(messages))
            opened = _Slave2(slave)
    try:
        yield opened
    finally:
        slave.freeInstance()


class _Slave2:
    """FMI 2.0. Final."""

    def __init__(self, slave: Any) -> None:
        self._slave = slave
        self.exit_initialization = slave.exitInitializationMode
        self.set_real = slave.setReal
        self.set_boolean = slave.setBoolean
        self.get_real = slave.getReal
        self.get_boolean = slave.getBoolean
        self.do_step = slave.doStep
        self.terminate = slave.terminate

    def enter_initialization(self, start_time: float) -> None:
        self._slave.setupExperiment(startTime=start_time)
        self._slave.enterInitializationMode()


class _Slave3:
    """FMI 3.0. Final."""

    def __init__(self, slave: Any) -> None:
        self._slave = slave
        self.exit_initialization = slave.exitInitializationMode
        self.set_real = slave.setFloat64
        self.set_boolean = slave.setBoolean
        self.get_real = slave.getFloat64
        self.get_boolean = slave.getBoolean
        self.do_step = slave.doStep
        self.terminate = slave.terminate

    def enter_initialization(self, start_time: float) -> None:
        self._slave.enterInitializationMode(startTime=start_time)


def _callbacks2(messages: list[str]) -> Any:
    """FMI 2.0 callbacks that keep what the FMU logs.

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


def _logger3(messages: list[str]) -> Any:
    def log(_environment: Any, status: int, _category: Any, message: Any) -> None:
        if status > fmi3.fmi3OK and message:
            messages.append(message.decode("utf-8", "replace"))

    return log
