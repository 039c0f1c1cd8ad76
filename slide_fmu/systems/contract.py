"""This module checks the declarations of a system: its sample step, inputs and outputs."""

from __future__ import annotations

import inspect
import math
from itertools import pairwise
from typing import Any

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import Signal
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError


class ContractError(LoadError):
    """A system breaks its contract; the message names the method and the remedy."""


def check_self_description(system: System, step: float | None, model: str) -> None:
    """Refuse a system with an invalid step or invalid signals.

    Args:
        system: the system.
        step: the sample step in s that it should have, or None where any will do.
        model: its name in the recipe, at the beginning of messages.

    Raises:
        ContractError: as in ``check_step`` and ``check_signals``.
    """
    try:
        check_step(system, step)
        check_signals(system)
    except ContractError as error:
        raise ContractError(f"system {model!r}: {error}") from error


def check_step(system: System, step: float | None) -> None:
    """Refuse a sample step that is no positive number, or not the one that was asked for.

    Args:
        system: the system.
        step: the sample step in s that it should have, or None where any will do.

    Raises:
        ContractError: its step is missing or different.
    """
    given: Any = getattr(system, "step", None)
    number = isinstance(given, float | int) and not isinstance(given, bool)
    if number and 0 < given < math.inf and (step is None or abs(given - step) <= 1e-9 * step):
        return
    expected = "the sample step in s that it simulates with, a positive number"
    if step is not None and step > 0:
        expected = f"{shown(step)}, the step that it was made with (in s)"
    raise contract_error(
        system, "step", f"is {shown(given)}", expected,
        "take an argument `step`, and keep it as it is given: self.step = step",
    )  # fmt: skip


def check_signals(system: System) -> None:
    """Refuse inputs and outputs that are no tuples of signals, or two signals of one name.

    Raises:
        ContractError: some signals are invalid.
    """
    names = []
    for what in ("inputs", "outputs"):
        signals = getattr(system, what, None)
        if not (
            isinstance(signals, tuple) and signals and all(isinstance(s, Signal) for s in signals)
        ):
            raise contract_error(
                system, what, f"is {shown(signals)}", "a tuple of slide_fmu.Signal, at least one",
                f'write self.{what} = (Signal("name", "unit", low, high),)',
            )  # fmt: skip
        names += [signal.name for signal in signals]
    twice = sorted({name for name, next_one in pairwise(sorted(names)) if name == next_one})
    if twice:
        raise contract_error(
            system, "inputs and outputs", f"share the names {twice}", "a name of its own for each",
            "rename one of each",
        )  # fmt: skip


def contract_error(
    system: Any, method: str, found: str, expected: str, remedy: str
) -> ContractError:
    """Return the error about a fault of a method or an attribute of a system."""
    return ContractError(f"{class_name(system)}.{method} {found}; expected {expected}: {remedy}")


def class_name(system: System) -> str:
    """Name the class of a system, and the file that it is in where it is not of this package."""
    kind = type(system)
    if kind.__module__.startswith("slide_fmu."):  # the user has another file
        return kind.__qualname__
    try:
        place = f" ({inspect.getfile(kind)})"
    except (TypeError, OSError):
        place = ""
    return f"system {kind.__qualname__}{place}"
