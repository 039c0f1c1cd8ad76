"""All calls of an instance pass through one place, which says why one failed."""

from __future__ import annotations

from collections.abc import Mapping
from ctypes import c_int
from typing import Any, Protocol

from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from slide_fmu.importer.errors import CoSimulationError, LostError
from slide_fmu.importer.logger_callbacks import last_texts


class FailedCallError(CoSimulationError):
    """A FailedCallError tells which call of an FMU failed, and what the FMU logged.

    Attributes:
        reason: the message without the name of the FMU.
        discarded: whether a step was discarded: a shorter one may succeed.
    """

    def __init__(self, label: str, reason: str, discarded: bool = False) -> None:
        super().__init__(label, reason, discarded)
        self.reason, self.discarded = reason, discarded

    def __str__(self) -> str:
        return ": ".join(self.args[:2])


class LostCallError(FailedCallError, LostError):
    """A LostCallError tells the same of a call that ended with a fatal error."""


class Witness(Protocol):
    """A Witness is told of the calls of an instance, which may never return."""

    def begin(self, call: str) -> None:
        """Take note that a call of this name begins."""

    def end(self) -> None:
        """Take note that it has returned."""


class GuardedCalls:
    """All calls of an instance pass through this, which says why one failed.

    Attributes:
        lost: whether a call ended with a fatal error.
        withdrawn: whether the instance was freed for another one.
        witness: is told of every call before it, and behind it; or None.
    """

    def __init__(self, label: str, functions: Mapping[str, Any], messages: list[str]) -> None:
        self.label, self.functions, self.messages = label, functions, messages
        self.lost = self.withdrawn = False
        self.witness: Witness | None = None

    def __call__(self, name: str, *arguments: Any) -> Any:
        if self.lost:
            return None
        if self.withdrawn:
            raise CoSimulationError(
                f"{self.label} allows one instance in a process "
                "(canBeInstantiatedOnlyOncePerProcess), and another one was made since; expected "
                "one at a time: begin anew"
            )
        function = self.functions[name]
        if (witness := self.witness) is None:
            result = function(*arguments)
        else:
            witness.begin(name)
            result = function(*arguments)
            witness.end()
        if function.restype is c_int and result > fmi2.fmi2Warning:
            raise self.failed(name, result)
        return result

    def failed(self, name: str, status: int) -> FailedCallError:
        """Return the error of a call with a status, which has what was logged."""
        self.lost = status == fmi2.fmi2Fatal
        what = str(FMICallException(name, status)).rstrip(".")
        why = last_texts(self.messages) or "without a reason: run this FMU alone"
        kind = LostCallError if self.lost else FailedCallError
        discarded = status == fmi2.fmi2Discard and name.endswith("DoStep")
        return kind(self.label, f"{what}: {why}", discarded)
