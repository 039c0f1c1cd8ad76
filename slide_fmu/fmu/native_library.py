"""The compiled library without FMI: its functions, and surrogates opened in it.

They are those of ``runtime/native/native.h``.
"""

from __future__ import annotations

import ctypes
import os
import threading
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.fmu.libraries.build import BINARIES, PYTHON_LIBRARIES

MESSAGE = 400
"""Bytes for the message of a refusal."""


class NativeError(RuntimeError):
    """The library is missing, refused the surrogate, or a result is not finite."""


def kernels() -> list[str]:
    """Name the kernels that this processor supports, the fastest first.

    Raises:
        NativeError: there is no compiled library.
    """
    library = load_library()
    names: list[str] = []
    while (name := library.slide_native_kernel(len(names))) is not None:
        names.append(name.decode().removeprefix("slide_kernel_"))
    return names


class Handles:
    """Handles are one surrogate, opened in the library as often as threads use it at once. Final.

    Args:
        name: of the surrogate, for messages.
        payload: the surrogate file.
        kernel: index into ``kernels()`` of that of the network.

    Attributes:
        library: what has the functions that take a handle.

    Raises:
        NativeError: there is no compiled library, or it refuses the surrogate.
    """

    def __init__(self, name: str, payload: bytes, kernel: int) -> None:
        self.library = load_library()
        self._name, self._payload, self._kernel = name, payload, kernel
        self._handles = [self._open()]
        self._lock = threading.Lock()

    @property
    def first(self) -> int:
        """The handle that is always open; functions that only read it may share it."""
        return self._handles[0]

    def _open(self) -> int:
        message = ctypes.create_string_buffer(MESSAGE)
        handle = self.library.slide_native_open(
            self._payload, len(self._payload), self._kernel, message, MESSAGE
        )
        if not handle:
            raise NativeError(f"surrogate {self._name!r}: {message.value.decode()}")
        weakref.finalize(self, self.library.slide_native_close, handle)
        return int(handle)

    def run(self, task: Callable[[int, slice], int], parts: list[slice]) -> None:
        """Do each part of some records with a handle of its own, which has states and scratch.

        The task takes the handle and the part, and returns 0 on success.

        Raises:
            NativeError: it does not.
        """
        if not parts:
            return
        with self._lock:
            while len(self._handles) < len(parts):
                self._handles.append(self._open())
            handles = self._handles[: len(parts)]
            if len(parts) == 1:
                failed = [task(handles[0], parts[0])]
            else:
                with ThreadPoolExecutor(len(parts)) as pool:
                    failed = list(pool.map(task, handles, parts))
        if any(failed):
            raise NativeError("a feature of the inputs is not finite, or there is no memory left")


def memory_sizes(payload: bytes, fmi: int, steps_per_sample: int) -> tuple[int, int]:
    """Measure the most memory that an FMU's instance takes, on any processor, in bytes.

    Args:
        payload: the surrogate file.
        fmi: major version of the FMU's standard.
        steps_per_sample: that are told apart, the macro ``SLIDE_STEPS_PER_SAMPLE``.

    Returns:
        Bytes of an instance whose name has at most 255 characters, and of one saved state.

    Raises:
        NativeError: there is no compiled library, or it refuses the surrogate.
    """
    sizes, message = (ctypes.c_size_t * 2)(), ctypes.create_string_buffer(MESSAGE)
    measure, given = load_library().slide_native_sizes, (payload, len(payload))
    if measure(*given, fmi, steps_per_sample, sizes, message, MESSAGE) != 0:
        raise NativeError(message.value.decode())
    return sizes[0], sizes[1]


def groups(count: int, together: int, threads: int) -> list[slice]:
    """Give slices of so many records, at most one for each thread, of whole groups."""
    whole = -(-count // together)
    bounds = np.linspace(0, whole, min(threads, whole) + 1).astype(int) * together
    return [slice(first, last) for first, last in pairwise(bounds.tolist())]


def checked_threads(threads: int | None) -> int:
    """Tell how many threads share the work: one per core if nothing is said.

    Raises:
        ValueError: it is to be none.
    """
    count = _available_cores() if threads is None else threads
    if count < 1:
        raise ValueError(f"threads {threads}; expected at least one")
    return count


def _available_cores() -> int:
    return (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )


def load_library() -> ctypes.CDLL:
    """Load the compiled library, whose functions then know what they take and give.

    Raises:
        NativeError: there is none.
    """
    path = library_path()
    if not path.is_file():
        raise NativeError(
            f"the compiled runtime {path} is missing; run: python -m slide_fmu.fmu.libraries.build"
        )
    library = ctypes.CDLL(str(path))
    handle, text, size = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t
    signatures: dict[str, list[Any]] = {
        "open": [handle, text, size, size, text, size],
        "close": [None, handle],
        "kernel": [text, size],
        "layers": [ctypes.c_int, handle, handle, size, handle],
        "records": [ctypes.c_int, handle, handle, size, size, size, size, size, handle],
        "sizes": [ctypes.c_int, text, size, *2 * [ctypes.c_uint32], handle, text, size],
        "slopes": [ctypes.c_int, handle, handle, handle, size, size, handle],
    }
    for name, (result, *arguments) in signatures.items():
        function = getattr(library, f"slide_native_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def library_path() -> Path:
    """Find the compiled library for Python of this platform.

    Raises:
        NativeError: there is none for it.
    """
    import fmpy  # here, since exports need sizes only of scalar sources

    names = [name for name in PYTHON_LIBRARIES if name.startswith(f"{fmpy.platform_tuple}/")]
    if not names:
        known = [*map(os.path.dirname, PYTHON_LIBRARIES)]
        raise NativeError(f"no library for {fmpy.platform_tuple}; expected one of {known}")
    return BINARIES / names[0]
