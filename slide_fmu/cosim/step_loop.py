"""The steps of a whole run are taken by a loop in C: in Python, calls cost more than most FMUs.

The loop is in the compiled library for Python (``runtime/native/steps.h``). It calls the functions
of the FMU, of any tool, in the order of ``InstanceVariables`` and ``Instance.do_step``.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native_library import NativeError, load_library
from slide_fmu.importer.instance import Instance
from slide_fmu.importer.variables import InstanceVariables, VariableBlock

LONGEST = 0.2
"""Time in s of one call, as far as it is known before. Between two of them Python sees that a user
wants to end it, however long a step of the FMU takes."""

_POINTER, _SIZE, _NUMBER = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_uint32


_Block = tuple[VariableBlock, NDArray[Any]]


class _Variables(ctypes.Structure):
    """``SlideVariables`` of ``steps.h``."""

    _fields_ = [
        ("call", _POINTER),
        ("references", _POINTER),
        ("count", _SIZE),
        ("values", _POINTER),
        ("row", _SIZE),
    ]


class _Steps(ctypes.Structure):
    """``SlideSteps`` of ``steps.h``."""

    _fields_ = [
        ("fmi", _NUMBER),
        ("component", _POINTER),
        ("do_step", _POINTER),
        ("begins", _POINTER),
        ("lengths", _POINTER),
        ("count", _SIZE),
        ("set", _POINTER),
        ("get", _POINTER),
        ("n_set", _SIZE),
        ("n_get", _SIZE),
        ("done", _SIZE),
        ("place", _SIZE),
        ("reached", ctypes.c_double),
        ("terminate", _NUMBER),
        ("early", _NUMBER),
    ]


def offered() -> bool:
    """Tell whether there is a compiled library for this platform."""
    return _library() is not None


@cache
def _library() -> ctypes.CDLL | None:
    try:
        return load_library()
    except NativeError:
        return None


def take_steps(
    instance: Instance,
    steps: tuple[FloatArray, FloatArray],
    inputs: tuple[InstanceVariables, FloatArray],
    recorded: InstanceVariables,
) -> FloatArray:
    """Set inputs, step and read, as often as there are steps; the instance is initialized.

    Args:
        instance: the instance.
        steps: begin and length of each step in s, (N,) each.
        inputs: variables, and the values that are set before each step, (N, n_inputs).
        recorded: variables that are read after each step.

    Returns:
        The values that were read, (N, n_recorded); Booleans are 0 or 1.

    Raises:
        CoSimulationError: a call failed, or a step ended early; the messages are those of the
            calls of ``Instance``.
    """
    whole = _WholeRun(instance, steps, inputs, recorded)
    first, together = 0, 1
    while first < whole.count:
        last, begin = min(first + together, whole.count), time.perf_counter()
        whole.take(first, last)
        brief = time.perf_counter() - begin < 0.5 * LONGEST
        first, together = last, 2 * together if brief else max(1, together // 2)
    return whole.values()


class _WholeRun:
    """The arrays of a run, in the types that the functions of the FMU have."""

    def __init__(
        self,
        instance: Instance,
        steps: tuple[FloatArray, FloatArray],
        inputs: tuple[InstanceVariables, FloatArray],
        recorded: InstanceVariables,
    ) -> None:
        self.instance = instance
        self.begins, self.lengths = (
            np.ascontiguousarray(part, dtype=np.float64) for part in steps
        )
        variables, rows = inputs
        self.count = len(rows)
        self.given: list[_Block] = [
            (block, np.ascontiguousarray(rows[:, block.columns], dtype=np.dtype(block.kind)))
            for block in variables.blocks
        ]
        self.read: list[_Block] = [
            (block, np.zeros((self.count, len(block.columns)), dtype=np.dtype(block.kind)))
            for block in recorded.blocks
        ]
        self.step = "fmi3DoStep" if instance.fmi_3 else "fmi2DoStep"
        setters = [block.setter for block, _ in self.given]
        self.calls = [*setters, self.step, *(block.getter for block, _ in self.read)]

    def take(self, first: int, last: int) -> None:
        """Take some of the steps."""
        library = _library()
        assert library is not None
        setters = [block.setter for block, _ in self.given]
        getters = [block.getter for block, _ in self.read]
        set_before = self._variables(self.given, setters, first)
        read_after = self._variables(self.read, getters, first)
        steps = _Steps(
            fmi=3 if self.instance.fmi_3 else 2,
            component=self.instance.calls.component,
            do_step=self._address(self.step),
            begins=self.begins[first:].ctypes.data,
            lengths=self.lengths[first:].ctypes.data,
            count=last - first,
            set=ctypes.addressof(set_before),
            get=ctypes.addressof(read_after),
            n_set=len(self.given),
            n_get=len(self.read),
        )
        status = library.slide_native_steps(ctypes.byref(steps))
        at = first + steps.done
        if status != 0:
            end = float(self.begins[at] + self.lengths[at])
            raise self.instance.failed(self.calls[steps.place], status, end)
        if steps.terminate or steps.early:
            begin, length = float(self.begins[at]), float(self.lengths[at])
            raise self.instance.ended(begin, length, steps.reached, bool(steps.terminate))

    def _variables(self, blocks: Sequence[_Block], names: Sequence[str], first: int) -> Any:
        """Return what ``SlideSteps`` refers to, for steps from one on."""
        return (_Variables * len(blocks))(
            *(
                _Variables(
                    call=self._address(name),
                    references=ctypes.addressof(block.numbers),
                    count=len(block.columns),
                    values=values[first:].ctypes.data,
                    row=values.strides[0],
                )
                for (block, values), name in zip(blocks, names, strict=True)
            )
        )

    def _address(self, name: str) -> int | None:
        return ctypes.cast(self.instance.function(name), ctypes.c_void_p).value

    def values(self) -> FloatArray:
        """Return all that was read, (N, n_recorded)."""
        every = np.empty((self.count, sum(len(block.columns) for block, _ in self.read)))
        for block, values in self.read:
            every[:, block.columns] = values
        return every
