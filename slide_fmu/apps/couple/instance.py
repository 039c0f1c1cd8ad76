"""Instances of the FMUs of components, whose refusals name the component."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException

from slide_fmu.apps.couple.component import LostError
from slide_fmu.apps.couple.structure import CoupledSystem
from slide_fmu.cosim.importer import ImportedSlave, open_slave
from slide_fmu.cosim.run import CoSimulationError, unpacked

FATAL = 4
"""Status of a call after which an FMU is lost."""


@contextmanager
def instance_of(system: CoupledSystem, name: str) -> Iterator[ImportedSlave]:
    """Instantiate the FMU of a component for the time of a ``with`` block.

    Raises:
        CoSimulationError: its library cannot be loaded, or it refuses a call.
    """
    with ExitStack() as stack:
        fmu = stack.enter_context(unpacked(system.paths[name]))
        messages: list[str] = []
        try:
            slave = stack.enter_context(open_slave(fmu.folder, fmu.description, name, messages))
        except Exception as error:  # fmpy raises bare Exception when a library cannot be loaded
            reason = "; ".join([str(error).rstrip("."), *messages])
            raise CoSimulationError(
                f"component {name!r}: {reason}; expected a library for this platform "
                f"({fmpy.platform}) that makes an instance: run this FMU alone, since it may tell "
                "more on the terminal"
            ) from error
        # all calls of FMPy's instance pass through this one
        slave.calls._call = _named(name, slave.calls._call, messages)
        yield slave


def _named(name: str, call: Callable[..., Any], messages: list[str]) -> Callable[..., Any]:
    """Return a call of a component that names it, and its messages, where it is refused.

    After a fatal error no call is allowed any more (FMI 2.0.5, section 2.1.3): none is made.
    """
    fatal: list[FMICallException] = []

    def named(*arguments: Any) -> Any:
        if fatal:
            return None
        try:
            return call(*arguments)
        except FMICallException as error:
            kind = CoSimulationError
            if error.status == FATAL:
                kind = LostError
                fatal.append(error)
            refused = f"{str(error).rstrip('.')}, without a reason: run this FMU alone"
            reason = "; ".join(messages) or refused
            raise kind(f"component {name!r} refuses a call: {reason}") from error

    return named
