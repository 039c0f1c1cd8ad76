"""A thin view of the native library, by FMI 2.0 or as both standards have it."""

from __future__ import annotations

import abc
import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

import fmpy
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

from slide_fmu.fmu.description.fmi2 import guid_of
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.places import Places
from tests.fmu.samples import STEP

OK, WARNING, DISCARD, ERROR = range(4)


class Instance(abc.ABC):
    """One FMU instance of some standard through ctypes: every call gives the bare FMI status.

    Attributes:
        library: has the functions of both standards.
        places: the variables.
        messages: what was logged so far.
        component: the pointer that the functions take.
    """

    fmi: FmiVersion

    def __init__(self, library: ctypes.CDLL, surrogate: Surrogate | None) -> None:
        self.library, self.places = library, Places(surrogate, self.fmi)
        self.messages: list[str] = []
        self.component = ctypes.c_void_p()

    def call(self, function: str, *arguments: object) -> int:
        return int(getattr(self.library, function)(self.component, *arguments))

    def of_state(self, verb: str, noun: str = "") -> str:
        """The function for states with such a name; the standards write it differently."""
        return f"fmi{self.fmi}{verb}FMU{'state' if self.fmi == 2 else 'State'}{noun}"

    @abc.abstractmethod
    def write(self, references: ctypes.Array[ctypes.c_uint], values: tuple[float, ...]) -> int:
        """Set variables of type Real."""

    @abc.abstractmethod
    def read(
        self, references: ctypes.Array[ctypes.c_uint], boolean: bool
    ) -> tuple[int, list[float]]:
        """Status and values of variables that are all Boolean, or all Real."""

    def hold_inputs(self) -> None:
        """All inputs are held over each step, where the surrogate was trained on held ones."""
        for reference in self.places.of_held():
            assert self.write((ctypes.c_uint * 1)(reference), (1.0,)) == OK

    def try_get(self, first: int, count: int = 1) -> tuple[int, list[float]]:
        return self.places.read(range(first, first + count), self.read)

    def get(self, first: int, count: int = 1) -> list[float]:
        status, values = self.try_get(first, count)
        assert status == OK, self.messages
        return values

    def save(self) -> bytes:
        """The serialised state."""
        state, size = ctypes.c_void_p(), ctypes.c_size_t()
        assert self.call(self.of_state("Get"), ctypes.byref(state)) == OK
        assert self.call(self.of_state("Serialized", "Size"), state, ctypes.byref(size)) == OK
        data = ctypes.create_string_buffer(size.value)
        assert self.call(self.of_state("Serialize"), state, data, size) == OK
        assert self.call(self.of_state("Free"), ctypes.byref(state)) == OK
        return data.raw

    def restore(self, data: bytes) -> int:
        """Status of deserialising and setting a state."""
        state = ctypes.c_void_p()
        verb = "DeSerialize" if self.fmi == 2 else "Deserialize"
        arguments = (data, ctypes.c_size_t(len(data)), ctypes.byref(state))
        status = self.call(self.of_state(verb), *arguments)
        if status == OK:
            status = self.call(self.of_state("Set"), state)
            self.call(self.of_state("Free"), ctypes.byref(state))
        return status


@final
class Native(Instance):
    """One FMU instance of FMI 2.0.

    Held inputs are held in every step, unless ``held`` is false: then those that move smoothly are
    taken to do so within steps, too.
    """

    fmi = 2

    def __init__(
        self,
        library: ctypes.CDLL,
        guid: str,
        uri: str,
        name: str = "one",
        surrogate: Surrogate | None = None,
        held: bool = True,
    ) -> None:
        super().__init__(library, surrogate)
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

    def start(self, time: float = 0.0) -> Native:
        zero = ctypes.c_double(0)
        assert self.call("fmi2SetupExperiment", 0, zero, ctypes.c_double(time), 0, zero) == OK
        assert self.call("fmi2EnterInitializationMode") == OK
        assert self.call("fmi2ExitInitializationMode") == OK
        return self

    def reset(self) -> int:
        """Status of a reset, after which inputs are held again."""
        status = self.call("fmi2Reset")
        self.hold_inputs()
        return status

    def set(self, *values: float, first: int = 0) -> int:
        return self.write(self.places.references(range(first, first + len(values))), values)

    def write(self, references: ctypes.Array[ctypes.c_uint], values: tuple[float, ...]) -> int:
        count = len(values)
        data = (ctypes.c_double * count)(*values)
        return self.call("fmi2SetReal", references, ctypes.c_size_t(count), data)

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

    def read(
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

    def free(self) -> None:
        self.library.fmi2FreeInstance(self.component)
        self.component = ctypes.c_void_p()


@dataclass
class ExportedFmu:
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


Load = Callable[[Surrogate], ExportedFmu]
"""The fixture ``load``: exports and unpacks a surrogate."""
