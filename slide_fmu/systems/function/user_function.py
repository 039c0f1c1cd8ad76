"""This module calls functions of the user, and checks their results."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray, check_inputs
from slide_fmu.systems.base import System, read_only, real_numbers
from slide_fmu.systems.contract import check_signals, check_step
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.specification import require_straight_inputs
from slide_fmu.systems.user_code import error_text

LONGEST = 120
"""What a function gave is cut after this number of characters in messages."""


class FunctionError(SimulationError):
    """A function of the user raised an error, or gave something else than the numbers expected."""


class UserFunction:
    """A UserFunction calls a function of (x, u, p) or (x, u, p, du) and checks what it gives.

    Attributes:
        name: name of the function, for messages.
        count: how many numbers it must give.
        takes_rates: whether it takes the rates of the inputs too.
        calls: how often it was called.
    """

    def __init__(self, name: str, function: Callable[..., Any], count: int) -> None:
        """Take a function that gives ``count`` numbers.

        Raises:
            LoadError: it is no function, or takes other arguments.
        """
        self.name, self.count, self._function, self.calls = name, count, function, 0
        arguments = ("x", "u", "p", "du")
        self.takes_rates = require_arguments(name, function, arguments, 3) == len(arguments)

    def __call__(self, x: FloatArray, u: FloatArray, p: object, du: FloatArray) -> FloatArray:
        """Give the numbers, shape (count,), perhaps not finite, as an array of their own.

        The function cannot write to x; u and du are the caller's to protect.

        Raises:
            FunctionError: the function raised, or gave something else than ``count`` numbers.
        """
        arguments = (read_only(x), u, p, du) if self.takes_rates else (read_only(x), u, p)
        self.calls += 1
        result = called_with(self.name, self._function, arguments)
        try:
            values = real_numbers(result)
        except (TypeError, ValueError):
            values = numbers_of(self.name, result, f"{self.count} numbers")
        if values.shape == (self.count,):
            return values
        if self.count == 1 and values.ndim == 0:
            return values.reshape(1)
        raise FunctionError(
            f"{self.name} gave {shown(result, LONGEST)} of shape {values.shape}; "
            f"expected {self.count} "
            f"numbers, shape ({self.count},)"
        )

    @property
    def bare(self) -> Callable[..., Any]:
        """The function of (x, u, p, du) as the user wrote it; nothing is checked."""
        function = self._function
        return function if self.takes_rates else lambda x, u, p, du: function(x, u, p)

    def of_lanes(
        self, x: FloatArray, u: FloatArray, p: object, du: FloatArray, values: FloatArray
    ) -> None:
        """Write the numbers of many states at once, (count, B), to ``values``.

        A number that is the same in all lanes may be given as one. The function sees arrays that
        it cannot write to.

        Args:
            x: states, (n, B).
            u, du: inputs and their rates, (n_inputs, B).
            p: parameters, of which some may be arrays (B,).
            values: gets the numbers, (count, B); B is more than 1.

        Raises:
            FunctionError: the function raised, or gave something else.
        """
        arguments: tuple[Any, ...] = (read_only(x), read_only(u), p)
        if self.takes_rates:
            arguments = (*arguments, read_only(du))
        self.calls += 1
        result = called_with(self.name, self._function, arguments)
        if self.count == 1 and np.shape(result) == x.shape[1:]:
            result = [result]
        try:
            for row, numbers in zip(values, result, strict=True):
                row[...] = numbers
        except (TypeError, ValueError) as error:
            raise FunctionError(
                f"{self.name} gave {shown(result, LONGEST)} for {x.shape[1]} states at once "
                f"({error}); expected {self.count} numbers or arrays of shape {x.shape[1:]}"
            ) from error

    def finite(self, x: FloatArray, u: FloatArray, p: object, du: FloatArray) -> FloatArray:
        """Give the numbers, which must be finite.

        Raises:
            FunctionError: as of a call, or a number is not finite.
        """
        with np.errstate(all="ignore"):  # what comes of it is refused below
            values = self(x, u, p, du)
        if not np.isfinite(values).all():
            raise FunctionError(f"{self.name} gave {values.tolist()}; expected finite numbers")
        return values


def called_with(name: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Call a function of the user.

    Raises:
        FunctionError: the function raised; the message has what, and its file and line.
    """
    try:
        return function(*arguments)
    except FunctionError:
        raise
    except (Exception, SystemExit) as error:  # a user's function may raise anything, and end
        raise FunctionError(f"{name} raised {error_text(error)}") from error


def with_columns(
    name: str, function: Callable[..., Any], count: int, columns: list[int]
) -> Callable[..., Any]:
    """Give a function whose results have these columns alone, of ``count`` that it gives.

    It is the function itself where all columns are wanted in their order.

    Raises:
        FunctionError: when called, where the function gives another number of columns.
    """
    if columns == list(range(count)) or not callable(function):
        return function

    @wraps(function)
    def chosen(*arguments: Any) -> FloatArray:
        values = numbers_of(name, function(*arguments), f"{count} columns")
        if values.shape[-1:] != (count,):
            raise FunctionError(
                f"{name} gave an array of shape {values.shape}; expected {count} columns, one for "
                "each output of the model, also where the recipe has fewer"
            )
        return values[..., columns]

    return chosen


def numbers_of(name: str, result: object, expected: str) -> FloatArray:
    """Return the result of a function as a new array.

    Raises:
        FunctionError: these are no real numbers; the message says what came.
    """
    try:
        return real_numbers(result)
    except (TypeError, ValueError) as error:
        text = f"{name} gave {shown(result, LONGEST)}, {error}; expected {expected}"
        raise FunctionError(text) from error


def require_arguments(name: str, function: object, arguments: tuple[str, ...], least: int) -> int:
    """Refuse what cannot be called with the first ``least`` of these arguments, or more of them.

    Returns:
        How many of the arguments it takes.

    Raises:
        LoadError: it is no function, or takes other arguments.
    """
    counts = range(len(arguments), least - 1, -1)
    forms = " or ".join(f"{name}({', '.join(arguments[:n])})" for n in reversed(counts))
    if not callable(function):
        raise LoadError(f"{name} = {function!r}; expected a function {forms}")
    signature = inspect.signature(function)
    for count in counts:
        try:
            signature.bind(*arguments[:count])
        except TypeError:
            continue
        _require_order(name, signature, arguments, forms)
        return count
    raise LoadError(f"{name}{signature}; expected {forms}: correct its arguments")


def _require_order(
    name: str, signature: inspect.Signature, arguments: tuple[str, ...], forms: str
) -> None:
    """Refuse arguments whose names say that they mean something else than what they are given.

    ``f(t, x, u)``, as of many solvers, could be called, and would take the states for the time.
    """
    names = list(signature.parameters)[: len(arguments)]
    if "t" not in arguments and not {"t", "time"}.isdisjoint(names):
        raise LoadError(
            f"{name}{signature} asks for the time; expected {forms}: a system follows from its "
            "inputs alone, so make what depends on the time an input, and leave the argument out"
        )
    moved = [one for k, one in enumerate(names) if one in arguments and arguments.index(one) != k]
    if moved:
        raise LoadError(
            f"{name}{signature} has {', '.join(moved)} at another place; expected {forms}: "
            "correct the order of its arguments"
        )


def require_signals(system: System) -> None:
    """Refuse signals that a system made of functions cannot have, and an invalid step.

    Raises:
        LoadError: no signal is given, they do not belong together, or the step is not positive.
    """
    check_step(system, None)
    check_signals(system)
    try:
        check_inputs(system.inputs)
    except ValueError as error:
        raise LoadError(str(error)) from error
    require_straight_inputs(system.inputs)
