"""The calls of a master under the same names for both standards; each gives the bare status."""

from __future__ import annotations

import abc
import ctypes

from .native import ERROR, OK, Loaded, Native
from .native3 import YES, Native3, with_separator


class Caller(abc.ABC):
    """One FMU instance as a master of some standard sees it."""

    @property
    @abc.abstractmethod
    def messages(self) -> list[str]:
        """What was logged so far."""

    @abc.abstractmethod
    def call(self, what: str, *arguments: object) -> int:
        """A function that both standards have, by the part of its name behind ``fmi2``."""

    @abc.abstractmethod
    def initialize(self, time: float) -> int:
        """Enter initialization mode with a start time."""

    @abc.abstractmethod
    def set(self, first: int, values: tuple[float, ...]) -> int:
        """Set variables that follow each other."""

    @abc.abstractmethod
    def get(self, first: int, count: int) -> tuple[int, list[float]]:
        """Values of variables that follow each other."""

    @abc.abstractmethod
    def do_step(self, time: float, length: float) -> int:
        """A communication step."""

    @abc.abstractmethod
    def time(self) -> float | None:
        """Time of the present state as the standard tells it, where it does now."""

    @abc.abstractmethod
    def wrong_calls(self) -> list[int]:
        """Status of calls that the standard refuses in every mode."""

    @abc.abstractmethod
    def save(self) -> bytes:
        """The serialised state."""

    @abc.abstractmethod
    def restore(self, data: bytes) -> int:
        """Deserialise and set a state."""

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


class Fmi2(Caller):
    """FMI 2.0. Final."""

    def __init__(self, loaded: Loaded) -> None:
        self.native = Native(loaded.library, loaded.guid, loaded.uri)

    @property
    def messages(self) -> list[str]:
        return self.native.messages

    def call(self, what: str, *arguments: object) -> int:
        return self.native.call(f"fmi2{what}", *arguments)

    def initialize(self, time: float) -> int:
        zero, start = ctypes.c_double(0), ctypes.c_double(time)
        status = self.call("SetupExperiment", 0, zero, start, 0, zero)
        return status if status != OK else self.call("EnterInitializationMode")

    def set(self, first: int, values: tuple[float, ...]) -> int:
        return self.native.set(*values, first=first)

    def get(self, first: int, count: int) -> tuple[int, list[float]]:
        return self.native.try_get(first, count)

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

    def save(self) -> bytes:
        return self.native.save()

    def restore(self, data: bytes) -> int:
        return self.native.restore(data)

    def free(self) -> None:
        self.native.free()


class Fmi3(Caller):
    """FMI 3.0. Final.

    Args:
        time_reference: value reference of the independent variable.
    """

    def __init__(self, loaded: Loaded, time_reference: int) -> None:
        resources = with_separator(loaded.folder / "resources")
        self.native = Native3(loaded.library, loaded.guid, resources)
        self.time_reference = time_reference

    @property
    def messages(self) -> list[str]:
        return self.native.messages

    def call(self, what: str, *arguments: object) -> int:
        return self.native.call(f"fmi3{what.replace('FMUstate', 'FMUState')}", *arguments)

    def initialize(self, time: float) -> int:
        return self.native.initialize(time)

    def set(self, first: int, values: tuple[float, ...]) -> int:
        wrong = self.native.set(*values, first=first, count=len(values) + 1)
        assert wrong == ERROR, "one value too many"
        return self.native.set(*values, first=first)

    def get(self, first: int, count: int) -> tuple[int, list[float]]:
        return self.native.try_get(first, count)

    def do_step(self, time: float, length: float) -> int:
        self.native.flags = ()
        status = self.native.do_step(time, length)
        if self.native.flags != (False, False, False):
            assert status == ERROR, "flags are set unless the mode is wrong"
            return status
        state = self.save()  # before the first step, reading a variable finds all outputs
        assert self.native.last == self.time(), "the time that doStep gives"
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

    def save(self) -> bytes:
        return self.native.save()

    def restore(self, data: bytes) -> int:
        return self.native.restore(data)

    def free(self) -> None:
        self.native.call("fmi3FreeInstance")
