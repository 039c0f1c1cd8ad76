"""Callbacks keep what an FMU logs, with numbers in its texts; ``calls.py`` puts it in errors."""

from __future__ import annotations

import platform
import re
import struct
import sys
from collections.abc import Callable, Iterator, Sequence
from ctypes import CFUNCTYPE, c_char_p, c_double, c_int, c_uint64, c_void_p, cast
from typing import Any

import fmpy
from fmpy import fmi2

SHOWN = 3
"""The last texts say why a call failed; an FMU may have logged thousands before."""

STACK_WORDS = 12
"""Number of 8-byte words on the stack in which further arguments of the logger are looked for."""

FLOAT_REGISTERS = 8
"""Number of registers for further arguments that are real numbers, on x86-64 and AArch64."""

MEMORY, LONGEST = "/proc/self/mem", 512
"""Texts that a text refers to are read here, at most this number of bytes: an FMU that forgot to
double a ``%`` must not end the process. Where there is no such file, the text stays as it is."""

CONVERSION = re.compile(
    r"%([-+#0]*)(\*|\d+)?(?:\.(\*|\d+)?)?(hh|h|ll|l|I64|j|z|t|L|q)?([a-zA-Z%])"
)
"""A conversion of C's ``printf``: flags, width, precision, size of the argument, and its kind."""

BITS = {"hh": 8, "h": 16, "": 32, "l": 64 if sys.platform != "win32" else 32}
"""Bits of whole numbers by their size in a conversion; 64 for all others."""


def last_texts(texts: Sequence[str]) -> str:
    """Join the last texts that an FMU logged; empty if it logged none."""
    return "; ".join(texts[-SHOWN:])


def logger(texts: list[str]) -> Callable[..., None]:
    """Make a callback of FMI 3.0 that keeps what the FMU logs as warning or worse."""

    def log(_environment: Any, status: int, _category: bytes, message: bytes) -> None:
        if status > fmi2.fmi2OK and message:
            texts.append(message.decode("utf-8", "replace"))

    return log


def callbacks_of_fmi2(texts: list[str]) -> Any:
    """Make callbacks of FMI 2.0 that keep what the FMU logs as warning or worse.

    Its texts are formats of ``printf`` with further arguments. fmpy's own proxy for them is left
    alone: it serves one logger in a process, and would outlive this one.
    """
    words = _Words.of_this_platform()

    def log(*arguments: Any) -> None:
        _environment, _name, status, _category, message, *further = arguments
        if status > fmi2.fmi2OK and message:
            texts.append(_formatted(message.decode("utf-8", "replace"), words.read(further)))

    fixed = (c_void_p, c_char_p, c_int, c_char_p, c_char_p)
    function = CFUNCTYPE(None, *fixed, *words.types)(log)
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = cast(function, fmi2.fmi2CallbackLoggerTYPE)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    callbacks.kept = function  # as long as the callbacks
    return callbacks


class _Words:
    """Where further arguments of a C function lie, by the calling convention of a platform.

    ctypes knows no variadic callbacks. But a callback that declares all registers, and some words
    of the stack, gets whatever lies there.

    Attributes:
        types: ctypes of these places.
        integers, reals: number of registers for whole numbers and for real ones, which come first.
        in_registers: whether further arguments come in registers at all.
    """

    def __init__(self, integers: int, reals: int, stack: int, in_registers: bool) -> None:
        self.integers, self.reals, self.in_registers = integers, reals, in_registers
        self.types = (c_uint64,) * integers + (c_double,) * reals + (c_uint64,) * stack

    @staticmethod
    def of_this_platform() -> _Words:
        """Return the places for a function with five fixed arguments before; maybe none."""
        machine = platform.machine().lower() if struct.calcsize("P") == 8 else "of 32 bits"
        if sys.platform == "win32" and machine == "amd64":
            return _Words(0, 0, STACK_WORDS, in_registers=False)
        if machine in ("x86_64", "amd64"):
            return _Words(1, FLOAT_REGISTERS, STACK_WORDS, in_registers=True)
        if machine in ("aarch64", "arm64"):  # Apple puts all of them on the stack
            on_stack = sys.platform == "darwin"
            return _Words(3, FLOAT_REGISTERS, STACK_WORDS, in_registers=not on_stack)
        return _Words(0, 0, 0, in_registers=False)

    def read(self, places: Sequence[int | float]) -> tuple[Iterator[int], Iterator[float]]:
        """Return whole and real numbers in the order of arguments; both share the stack."""
        stack = iter([int(word) for word in places[self.integers + self.reals :]])

        def rest() -> Iterator[int]:
            yield from stack

        def real_rest() -> Iterator[float]:
            for word in stack:
                yield struct.unpack("<d", struct.pack("<Q", word))[0]

        def joined(registers: Sequence[Any], others: Iterator[Any]) -> Iterator[Any]:
            yield from registers if self.in_registers else ()
            yield from others

        end = self.integers + self.reals
        whole = joined(places[: self.integers], rest())
        return whole, joined(places[self.integers : end], real_rest())


def _formatted(text: str, arguments: tuple[Iterator[int], Iterator[float]]) -> str:
    """Put further arguments into a text; it stays as it is where they cannot be known."""
    whole, real = arguments

    def put(match: re.Match[str]) -> str:
        flags, width, precision, size, kind = match.groups()
        if kind == "%":
            return "%"
        width, precision = (
            str(_signed(next(whole), 32)) if part == "*" else part for part in (width, precision)
        )
        form = f"%{flags}{width or ''}"
        form += f".{precision or 0}" if "." in match[0] else ""
        if kind in "diuxXoc":
            return (form + kind) % _signed_as(kind, next(whole), BITS.get(size or "", 64))
        if kind in "eEfFgG" and size != "L":
            return (form + kind) % next(real)
        if kind == "s":
            return (form + "s") % _text_at(next(whole))
        if kind == "p":
            return hex(next(whole))
        raise ValueError(match[0])

    try:
        return CONVERSION.sub(put, text)
    except (StopIteration, OSError, ValueError, OverflowError):
        return text.replace("%%", "%")


def _text_at(address: int) -> str:
    """Return the text at an address; raises an OSError where there is none."""
    with open(MEMORY, "rb", buffering=0) as memory:
        memory.seek(address)
        return memory.read(LONGEST).partition(b"\0")[0].decode("utf-8", "replace")


def _signed_as(kind: str, word: int, bits: int) -> int | str:
    """Return the number in a word of the stack or a register, or the letter of one."""
    if kind == "c":
        return chr(word & 0xFF)
    return _signed(word, bits) if kind in "di" else word & ((1 << bits) - 1)


def _signed(word: int, bits: int) -> int:
    """Return the signed number that the lowest bits of a word have."""
    value = word & ((1 << bits) - 1)
    return value - (1 << bits) if value >> (bits - 1) else value
