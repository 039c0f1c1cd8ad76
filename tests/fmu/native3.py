"""A thin view of the FMI 3.0 functions of the native library: every call gives the bare status."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, final

import numpy as np
from fmpy.fmi3 import fmi3IntermediateUpdateCallback, fmi3LogMessageCallback

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import OK, ExportedFmu, Instance
from tests.fmu.samples import STEP

Watch = Callable[[float, bool], float | None]
"""Called at each sample of a step: the time, and whether inputs may be set."""

NO, YES = ctypes.c_bool(False), ctypes.c_bool(True)


@final
class Native3(Instance):
    """One FMU instance of FMI 3.0."""

    fmi = 3

    def __init__(
        self,
        library: ctypes.CDLL,
        guid: str,
        resources: Path | str | None,
        logging: bool = False,
        events: bool = False,
        watch: Watch | None = None,
        ends: bool = False,
        surrogate: Surrogate | None = None,
    ) -> None:
        super().__init__(library, surrogate)
        self._logger = fmi3LogMessageCallback(self._log)
        place = None if resources is None else str(resources).encode()
        arguments = (b"one", guid.encode(), place, NO, ctypes.c_bool(logging))
        self._watch = watch
        self._watcher = None if watch is None else fmi3IntermediateUpdateCallback(self._show)
        early = ctypes.c_bool(ends)
        none = (None, ctypes.c_size_t(0), None)
        more = (ctypes.c_bool(events), early, *none, self._logger, self._watcher)
        library.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
        pointer = library.fmi3InstantiateCoSimulation(*arguments, *more)
        self.component = ctypes.c_void_p(pointer)
        self.last = 0.0
        self.flags: tuple[bool, ...] = ()

    def _log(self, _environment: object, _status: int, _kind: bytes, text: bytes) -> None:
        self.messages.append(text.decode())

    def _show(
        self,
        _environment: object,
        time: float,
        may_set: bool,
        may_get: bool,
        finished: bool,
        may_end: bool,
        ends: object,
        until: object,
    ) -> None:
        """Intermediate update; the watcher gives the time at which the step shall end, or None."""
        assert may_get
        assert finished
        assert self._watch is not None
        end = self._watch(time, bool(may_set))
        if end is not None:
            ends[0], until[0] = True, end  # type: ignore[index]

    def initialize(self, time: float = 0.0, stop: float | None = None) -> int:
        zero, end = ctypes.c_double(0), ctypes.c_double(stop or 0.0)
        defined = ctypes.c_bool(stop is not None)
        arguments = (NO, zero, ctypes.c_double(time), defined, end)
        return self.call("fmi3EnterInitializationMode", *arguments)

    def start(self, time: float = 0.0) -> Native3:
        assert self.initialize(time) == OK, self.messages
        assert self.call("fmi3ExitInitializationMode") == OK
        return self

    def set(self, *values: float, first: int = 0, count: int | None = None) -> int:
        references = self.places.references(range(first, first + len(values)))
        return self.write(references, values, count)

    def write(
        self,
        references: ctypes.Array[ctypes.c_uint],
        values: tuple[float, ...],
        count: int | None = None,
    ) -> int:
        n, data = ctypes.c_size_t(len(values)), (ctypes.c_double * len(values))(*values)
        n_values = n if count is None else ctypes.c_size_t(count)
        return self.call("fmi3SetFloat64", references, n, data, n_values)

    def read(
        self, references: ctypes.Array[ctypes.c_uint], boolean: bool
    ) -> tuple[int, list[float]]:
        values = ((ctypes.c_bool if boolean else ctypes.c_double) * len(references))()
        function = "fmi3GetBoolean" if boolean else "fmi3GetFloat64"
        n = ctypes.c_size_t(len(references))
        return self.call(function, references, n, values, n), list(values)

    def do_step(self, time: float, step: float = STEP) -> int:
        event, terminate, early = (ctypes.c_bool(True) for _ in range(3))
        last = ctypes.c_double(-1)
        flags = map(ctypes.byref, (event, terminate, early, last))
        arguments = (ctypes.c_double(time), ctypes.c_double(step), YES)
        status = self.call("fmi3DoStep", *arguments, *flags)
        self.last, self.flags = last.value, (event.value, terminate.value, early.value)
        return status

    def derivative(
        self, function: str, unknowns: range, knowns: range, seed: FloatArray
    ) -> FloatArray:
        """Sensitivity of ``fmi3GetDirectionalDerivative`` or ``fmi3GetAdjointDerivative``."""
        count = len(knowns) if function == "fmi3GetAdjointDerivative" else len(unknowns)
        sensitivity = (ctypes.c_double * count)()
        pairs = map(self.places.references, (unknowns, knowns))
        references = [part for pair in pairs for part in (pair, ctypes.c_size_t(len(pair)))]
        seeds = (ctypes.c_double * len(seed))(*seed)
        n_seeds, n_found = ctypes.c_size_t(len(seed)), ctypes.c_size_t(count)
        status = self.call(function, *references, seeds, n_seeds, sensitivity, n_found)
        assert status == OK, self.messages
        return np.array(sensitivity)


def instance_of(loaded: ExportedFmu, held: bool = True, **options: Any) -> Native3:
    """An FMU as an instance of FMI 3.0; options are those of Native3.

    Held inputs are held in every step, unless ``held`` is false: then those that move smoothly are
    taken to do so within steps, too.
    """
    folder = with_separator(loaded.folder / "resources")
    made = Native3(loaded.library, loaded.guid, folder, surrogate=loaded.surrogate, **options)
    if held and made.component.value:
        made.hold_inputs()
    return made


def with_separator(folder: Path) -> str:
    """A folder as the standard passes it: with a separator at its end."""
    return f"{folder}{os.sep}"
