"""A thin view of the native library: every call gives the bare FMI status."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.fmi2 import guid_of
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.places import Places
from tests.fmu.samples import STEP

OK, WARNING, DISCARD, ERROR = range(4)


class Native:
    """One FMU instance through ctypes: every call gives the bare FMI status.

    Held inputs are held in every step, unless ``held`` is false: then those that move smoothly are
    taken to do so within steps, too.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        guid: str,
        uri: str,
        name: str = "one",
        surrogate: Surrogate | None = None,
        held: bool = True,
    ) -> None:
        self.library = library
        self.places = Places(surrogate, 2)
        self.messages: list[str] = []
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        self._callbacks = callbacks
        library.fmi2Instantiate.restype = ctypes.c_void_p
        pointer = library.fmi2Instantiate(
            name.encode(), 1, guid.encode(), uri.encode(), ctypes.byref(callbacks), 0, 0
        )
        self.component = ctypes.c_void_p(pointer)
        self.steps = 0
        if held and pointer:
            self.hold_inputs()

    def _log(self, _env: object, _name: bytes, _status: int, _kind: bytes, text: bytes) -> None:
        self.messages.append(text.decode())

    def call(self, function: str, *arguments: object) -> int:
        return int(getattr(self.library, function)(self.component, *arguments))

    def start(self, time: float = 0.0) -> Native:
        zero = ctypes.c_double(0)
        assert self.call("fmi2SetupExperiment", 0, zero, ctypes.c_double(time), 0, zero) == OK
        assert self.call("fmi2EnterInitializationMode") == OK
        assert self.call("fmi2ExitInitializationMode") == OK
        return self

    def hold_inputs(self) -> None:
        """All inputs are held over each step, where the surrogate was trained on held ones."""
        for reference in self.places.of_held():
            number = ctypes.byref(ctypes.c_uint(reference))
            one, value = ctypes.c_size_t(1), ctypes.byref(ctypes.c_double(1))
            assert self.call("fmi2SetReal", number, one, value) == OK

    def reset(self) -> int:
        """Status of a reset, after which inputs are held again."""
        status = self.call("fmi2Reset")
        self.hold_inputs()
        return status

    def set(self, *values: float, first: int = 0) -> int:
        count = len(values)
        references = self.places.references(range(first, first + count))
        return self.call(
            "fmi2SetReal", references, ctypes.c_size_t(count), (ctypes.c_double * count)(*values)
        )

    def set_rates(self, *rates: float, first: int = 0, order: int = 1) -> int:
        """Derivatives of inputs with respect to time, in 1/s."""
        count = len(rates)
        return self.call(
            "fmi2SetRealInputDerivatives",
            self.places.references(range(first, first + count)),
            ctypes.c_size_t(count),
            (ctypes.c_int * count)(*[order] * count),
            (ctypes.c_double * count)(*rates),
        )

    def get(self, first: int, count: int = 1) -> list[float]:
        status, values = self.try_get(first, count)
        assert status == OK, self.messages
        return values

    def try_get(self, first: int, count: int = 1) -> tuple[int, list[float]]:
        return self.places.read(range(first, first + count), self._read)

    def _read(
        self, references: ctypes.Array[ctypes.c_uint], boolean: bool
    ) -> tuple[int, list[float]]:
        values = ((ctypes.c_int if boolean else ctypes.c_double) * len(references))()
        function = "fmi2GetBoolean" if boolean else "fmi2GetReal"
        count = ctypes.c_size_t(len(references))
        return self.call(function, references, count, values), list(values)

    def do_step(self, time: float, step: float = STEP) -> int:
        return self.call("fmi2DoStep", ctypes.c_double(time), ctypes.c_double(step), 1)

    def step(self, *inputs: float) -> None:
        if inputs:
            assert self.set(*inputs) == OK, self.messages
        assert self.do_step(self.steps * STEP) == OK, self.messages
        self.steps += 1

    def time(self) -> float:
        """Time of the present state."""
        last = ctypes.c_double()
        assert self.call("fmi2GetRealStatus", 2, ctypes.byref(last)) == OK
        return last.value

    def save(self) -> bytes:
        """The serialised state."""
        state, size = ctypes.c_void_p(), ctypes.c_size_t()
        assert self.call("fmi2GetFMUstate", ctypes.byref(state)) == OK
        assert self.call("fmi2SerializedFMUstateSize", state, ctypes.byref(size)) == OK
        data = ctypes.create_string_buffer(size.value)
        assert self.call("fmi2SerializeFMUstate", state, data, size) == OK
        assert self.call("fmi2FreeFMUstate", ctypes.byref(state)) == OK
        return data.raw

    def restore(self, data: bytes) -> int:
        """Status of deserialising and setting a state."""
        state = ctypes.c_void_p()
        arguments = (data, ctypes.c_size_t(len(data)), ctypes.byref(state))
        status = self.call("fmi2DeSerializeFMUstate", *arguments)
        if status == OK:
            status = self.call("fmi2SetFMUstate", state)
            self.call("fmi2FreeFMUstate", ctypes.byref(state))
        return status

    def free(self) -> None:
        self.library.fmi2FreeInstance(self.component)
        self.component = ctypes.c_void_p()


@dataclass
class Loaded:
    """An exported and unpacked FMU."""

    surrogate: Surrogate
    path: Path
    folder: Path
    instances: list[Native] = field(default_factory=list)

    @property
    def guid(self) -> str:
        return guid_of(self.surrogate.to_bytes())

    @property
    def uri(self) -> str:
        return (self.folder / "resources").as_uri()

    @property
    def library(self) -> ctypes.CDLL:
        folder = self.folder / "binaries" / fmpy.platform
        return ctypes.CDLL(str(next(folder.glob(f"{self.surrogate.name}.*"))))

    def instance(
        self, guid: str | None = None, uri: str | None = None, held: bool = True
    ) -> Native:
        made = Native(
            self.library, guid or self.guid, uri or self.uri, surrogate=self.surrogate, held=held
        )
        self.instances.append(made)
        return made


def outputs_of_steps(native: Native, rows: FloatArray, length: float) -> FloatArray:
    """Two inputs a row, a step of a length in h after each: the two outputs, shape (N, 2)."""
    outputs = []
    for row in rows:
        assert native.set(*row) == OK
        assert native.do_step(native.time(), length * STEP) == OK, native.messages
        outputs.append(native.get(2, 2))
    return np.array(outputs)


Load = Callable[[Surrogate], Loaded]
"""The fixture ``load``: exports and unpacks a surrogate."""
