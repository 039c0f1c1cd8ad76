"""The compiled library is used without FMI: its functions, and surrogates opened in it.

The functions are declared in ``runtime/native/native.h`` and ``steps.h``.
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
from typing import Any, final

import numpy as np

from slide_fmu.fmu.libraries.build import BINARIES, PYTHON_LIBRARIES
from slide_fmu.fmu.libraries.platforms import COMMAND, require_new_libraries

MESSAGE = 400
"""Length of the buffer for an error message, in bytes."""


class NativeError(RuntimeError):
    """The library is missing, refused the surrogate, or a result is not finite."""


def kernels() -> list[str]:
    """Return the names of the kernels that this processor supports, the fastest first.

    Raises:
        NativeError: there is no compiled library.
    """
    library = load_library()
    names: list[str] = []
    while (name := library.slide_native_kernel(len(names))) is not None:
        names.append(name.decode().removeprefix("slide_kernel_"))
    return names


@final
class Handles:
    """Handles open one surrogate in the library as many times as threads use it at once.

    Args:
        name: name of the surrogate, for messages.
        payload: the surrogate file.
        kernel: index into ``kernels()``, for the network's kernel.

        Attributes:
            library: has the functions that take a handle.

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
        """The handle that is always open; functions that only read may share it."""
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
        """Do each part of some sequences with its own handle, which has states and scratch memory.

        The task takes the handle and the part, and returns 0 on success.

        Raises:
            NativeError: a task failed.
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
    """Return an upper limit of the memory of an FMU's instance, on any processor, in bytes.

    Args:
        payload: the surrogate file.
        fmi: major version of the FMU's standard.
        steps_per_sample: number of communication steps that are distinguished in a sample step, as
            in the macro ``SLIDE_STEPS_PER_SAMPLE``.

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
    """Return slices of ``count`` sequences, at most one for each thread, of whole groups."""
    whole = -(-count // together)
    bounds = np.linspace(0, whole, min(threads, whole) + 1).astype(int) * together
    return [slice(first, last) for first, last in pairwise(bounds.tolist())]


def checked_threads(threads: int | None) -> int:
    """Return the number of threads that share the work: one per core by default.

    Raises:
        ValueError: the number is below 1.
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
    """Load the compiled library, and declare the types of its functions.

    Raises:
        NativeError: the library is missing.
        OldLibrariesError: it was compiled from other sources.
    """
    path = library_path()
    if not path.is_file():
        raise NativeError(f"the compiled runtime {path} is missing; run: {COMMAND}")
    require_new_libraries()
    library = ctypes.CDLL(str(path))
    handle, text, size = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t
    signatures: dict[str, list[Any]] = {
        "open": [handle, text, size, size, text, size],
        "close": [None, handle],
        "kernel": [text, size],
        "layers": [ctypes.c_int, handle, handle, size, handle],
        "records": [ctypes.c_int, handle, handle, size, size, size, size, size, handle],
        "sizes": [ctypes.c_int, text, size, *2 * [ctypes.c_uint32], handle, text, size],
        "steps": [ctypes.c_int, handle],
        "slopes": [ctypes.c_int, handle, handle, handle, size, size, handle],
    }
    for name, (result, *arguments) in signatures.items():
        function = getattr(library, f"slide_native_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def library_path() -> Path:
    """Find the compiled library for Python of this platform.

    Raises:
        NativeError: there is no library for this platform.
    """
    import fmpy  # imported late: only exports of scalar sources need sizes

    names = [name for name in PYTHON_LIBRARIES if name.startswith(f"{fmpy.platform_tuple}/")]
    if not names:
        known = [*map(os.path.dirname, PYTHON_LIBRARIES)]
        raise NativeError(f"no library for {fmpy.platform_tuple}; expected one of {known}")
    return BINARIES / names[0]
