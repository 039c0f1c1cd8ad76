"""What FMUs log as warning or worse is kept, for messages about what failed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import fmpy
from fmpy import fmi2


def logger(messages: list[str]) -> Callable[..., None]:
    """Make a callback, of either standard, that keeps what the FMU logs as warning or worse."""

    def log(*arguments: Any) -> None:
        *caller, status, _category, message = arguments
        if status > fmi2.fmi2OK and message:
            text = message.decode("utf-8", "replace")
            messages.append(text.replace("%%", "%") if len(caller) == 2 else text)

    return log


def callbacks_of_fmi2(messages: list[str]) -> Any:
    """Make callbacks of FMI 2.0 that keep what the FMU logs.

    fmpy's own proxy for printf-like messages is left alone: it serves one logger per process, and
    would outlive this one. Messages without arguments need it only for their doubled signs.
    """
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(logger(messages))
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return callbacks
