"""The calls of an importer under the same names for both standards; each gives the bare status."""

from __future__ import annotations

import abc
import ctypes
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.surrogate_variables import block_size, fmu_variables
from tests.fmu.native import ERROR, OK, ExportedFmu, Instance, Native
from tests.fmu.native3 import YES, Native3, with_separator
from tests.fmu.plain_fmu import Plan
from tests.fmu.samples import STEP

Found = tuple[int, list[float]]
"""Status and values."""


class Caller(abc.ABC):
    """One FMU instance as an importer of some standard sees it.

    Attributes:
        largest_prehistory: of the values of ``prehistory_known``.
        native: the instance.
    """

    largest_prehistory: int
    native: Instance

    @property
    def messages(self) -> list[str]:
        """What was logged so far."""
        return self.native.messages

    @abc.abstractmethod
    def call(self, what: str, *arguments: object) -> int:
        """A function that both standards have, by the part of its name behind ``fmi2``."""

    @abc.abstractmethod
    def initialize(self, time: float, stop: float | None) -> int:
        """Enter initialization mode with a start time and perhaps a stop time."""

    @abc.abstractmethod
    def set(self, first: int, values: tuple[float, ...]) -> int:
        """Set variables that follow each other."""

    def get(self, first: int, count: int) -> Found:
        """Values of variables that follow each other."""
        return self.native.try_get(first, count)

    @abc.abstractmethod
    def directional(self, unknowns: range, knowns: range, seed: FloatArray) -> Found:
        """Directional derivative."""

    @abc.abstractmethod
    def do_step(self, time: float, length: float) -> int:
        """A communication step."""

    @abc.abstractmethod
    def time(self) -> float | None:
        """Time of the present state as the standard tells it, where it does now."""

    @abc.abstractmethod
    def wrong_calls(self) -> list[int]:
        """Status of calls that the standard refuses in every mode."""

    def save(self) -> bytes:
        """The serialised state."""
        return self.native.save()

    def restore(self, data: bytes) -> int:
        """Deserialise and set a state."""
        return self.native.restore(data)

    @abc.abstractmethod
    def free(self) -> None:
        """End the instance."""

    def take_state(self, state: ctypes.c_void_p) -> int:
        """Save the state, over one that is there already."""
        return self.call("GetFMUstate", ctypes.byref(state))

    def put_state(self, state: ctypes.c_void_p) -> int:
        """Go back to a saved state."""
        return self.call("SetFMUstate", state)

    def free_state(self, state: ctypes.c_void_p) -> int:
        """Free a saved state."""
        return self.call("FreeFMUstate", ctypes.byref(state))


@final
class Fmi2(Caller):
    """FMI 2.0."""

    largest_prehistory = 1
    native: Native

    def __init__(self, loaded: ExportedFmu) -> None:
        self.native = Native(loaded.library, loaded.guid, loaded.uri, surrogate=loaded.surrogate)

    def call(self, what: str, *arguments: object) -> int:
        return self.native.call(f"fmi2{what}", *arguments)

    def initialize(self, time: float, stop: float | None) -> int:
        zero, start, end = map(ctypes.c_double, (0, time, stop or 0))
        status = self.call("SetupExperiment", 0, zero, start, int(stop is not None), end)
        return status if status != OK else self.call("EnterInitializationMode")

    def set(self, first: int, values: tuple[float, ...]) -> int:
        return self.native.set(*values, first=first)

    def set_rates(self, rates: tuple[float, ...], order: int) -> int:
        """Derivatives of the inputs in the next step."""
        return self.native.set_rates(*rates, order=order)

    def directional(self, unknowns: range, knowns: range, seed: FloatArray) -> Found:
        found = (ctypes.c_double * len(unknowns))()
        status = self.call(
            "GetDirectionalDerivative", *_pair(self.native, unknowns, knowns, seed), found
        )
        return status, list(found)

    def do_step(self, time: float, length: float) -> int:
        return self.native.do_step(time, length)

    def time(self) -> float | None:
        last = ctypes.c_double()
        status = self.call("GetRealStatus", 2, ctypes.byref(last))
        return last.value if status == OK else None

    def wrong_calls(self) -> list[int]:
        one = ctypes.c_size_t(1)
        return [
            self.call("CancelStep"),
            self.call("GetInteger", None, one, None),
            self.call("EnterEventMode"),
            self.call("SetFMUstate", None),
        ]

    def free(self) -> None:
        self.native.free()


@final
class Fmi3(Caller):
    """FMI 3.0.

    Args:
        watches: it has a callback for intermediate update, and may end steps early.

    Attributes:
        plan: what the importer does in a step that it watches; it reads after every sample.
        ended_early: the last step did.
    """

    largest_prehistory = 2
    native: Native3

    def __init__(self, loaded: ExportedFmu, watches: bool = False) -> None:
        resources = with_separator(loaded.folder / "resources")
        watch = self._watch if watches else None
        self.native = Native3(
            loaded.library,
            loaded.guid,
            resources,
            watch=watch,
            ends=watches,
            surrogate=loaded.surrogate,
        )
        self.native.hold_inputs()
        surrogate = loaded.surrogate
        names = [variable.name for variable in fmu_variables(surrogate, 3)]
        self.n_inputs, n_outputs = len(surrogate.inputs), len(surrogate.outputs)
        self.outputs = range(self.n_inputs, self.n_inputs + n_outputs)
        self.time_reference, self.size = names.index("time"), block_size(surrogate)
        self.first_window = self.time_reference + 1 if self.size > 1 else self.n_inputs
        self.first_initial = names.index(f"initial_{surrogate.inputs[0].name}_window")
        self.plan, self.begin, self.ended_early = Plan(), 0.0, False
        self._failed: AssertionError | None = None

    def _watch(self, time: float, may_set: bool) -> float | None:
        try:
            return self._look(time, may_set)
        except AssertionError as error:  # none gets through the library
            self._failed = error
            return None

    def _look(self, time: float, may_set: bool) -> float | None:
        assert self.time() == time
        status, windows = self.output_windows()
        assert status == OK
        assert np.all(np.isfinite(windows))
        sample = round((time - self.begin) / STEP)
        if may_set and sample in self.plan.inputs:
            assert self.set(0, self.plan.inputs[sample]) == OK
        return self.begin + self.plan.until * STEP if sample == self.plan.asked else None

    def call(self, what: str, *arguments: object) -> int:
        return self.native.call(f"fmi3{what.replace('FMUstate', 'FMUState')}", *arguments)

    def initialize(self, time: float, stop: float | None) -> int:
        return self.native.initialize(time, stop)

    def set(self, first: int, values: tuple[float, ...]) -> int:
        wrong = self.native.set(*values, first=first, count=len(values) + 1)
        assert wrong == ERROR, "one value too many"
        return self.native.set(*values, first=first)

    def _arrays(self, references: range, n_values: int) -> Found:
        values, count = (ctypes.c_double * n_values)(), ctypes.c_size_t(len(references))
        n = ctypes.c_size_t(n_values)
        return self.call(
            "GetFloat64", self.native.places.references(references), count, values, n
        ), list(values)

    def output_windows(self) -> tuple[int, FloatArray]:
        """The arrays of the outputs, (n, n_outputs); where there are none, the outputs."""
        n_outputs = len(self.outputs)
        references = range(self.first_window, self.first_window + n_outputs)
        assert self._arrays(references, n_outputs * self.size - 1)[0] == ERROR, "one value missing"
        status, values = self._arrays(references, n_outputs * self.size)
        newest = self.get(self.n_inputs, n_outputs)
        windows = np.array(values).reshape(n_outputs, self.size).T
        assert newest == (status, windows[-1].tolist()), "the newest sample is the output"
        return status, windows

    def initial_windows(self, size: int) -> Found:
        """Samples of the inputs before the start, those of one input after the other."""
        references = range(self.first_initial, self.first_initial + self.n_inputs)
        return self._arrays(references, self.n_inputs * size)

    def set_initial_windows(self, rows: FloatArray) -> int:
        """Set them, (n, n_inputs)."""
        references = self.native.places.references(
            range(self.first_initial, self.first_initial + self.n_inputs)
        )
        values = (ctypes.c_double * rows.size)(*rows.T.ravel())
        count, n = ctypes.c_size_t(self.n_inputs), ctypes.c_size_t(rows.size)
        return self.call("SetFloat64", references, count, values, n)

    def directional(self, unknowns: range, knowns: range, seed: FloatArray) -> Found:
        return self._derivative("GetDirectionalDerivative", unknowns, knowns, seed, len(unknowns))

    def adjoint(self, unknowns: range, knowns: range, seed: FloatArray) -> Found:
        """Adjoint derivative: the seed is one of the unknowns."""
        return self._derivative("GetAdjointDerivative", unknowns, knowns, seed, len(knowns))

    def _derivative(
        self, what: str, unknowns: range, knowns: range, seed: FloatArray, count: int
    ) -> Found:
        given = _pair(self.native, unknowns, knowns, seed)
        found = (ctypes.c_double * count)()
        n_seed, n_found = ctypes.c_size_t(len(seed)), ctypes.c_size_t(count)
        assert self.call(what, *given, n_seed, found, ctypes.c_size_t(count + 1)) == ERROR
        return self.call(what, *given, n_seed, found, n_found), list(found)

    def do_step(self, time: float, length: float) -> int:
        self.native.flags, self.begin = (), time
        status = self.native.do_step(time, length)
        if self._failed is not None:
            raise self._failed
        *others, self.ended_early = self.native.flags
        if any(others):
            assert status == ERROR, "flags are set unless the mode is wrong"
            return status
        state = self.save()  # before the first step, reading a variable finds all outputs
        assert self.time() in (self.native.last, None), "the time that doStep gives"
        assert self.restore(state) == OK
        return status

    def time(self) -> float | None:
        status, values = self.native.try_get(self.time_reference)
        return values[0] if status == OK else None

    def wrong_calls(self) -> list[int]:
        one, zero = ctypes.c_size_t(1), ctypes.c_double(0)
        return [
            self.call("EnterEventMode"),
            self.call("GetInt32", None, one, None, one),
            self.call("DoStep", zero, zero, YES, None, None, None, None),
            self.call("SetFMUstate", None),
        ]

    def free(self) -> None:
        self.native.call("fmi3FreeInstance")


def _pair(native: Instance, unknowns: range, knowns: range, seed: FloatArray) -> list[object]:
    """The arguments that functions for derivatives begin with."""
    numbers = [
        (native.places.references(some), ctypes.c_size_t(len(some))) for some in (unknowns, knowns)
    ]
    return [*numbers[0], *numbers[1], (ctypes.c_double * len(seed))(*seed)]
