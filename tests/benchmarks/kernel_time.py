"""Time per step inside C: the runtime's objects, linked with a loop around them."""

from __future__ import annotations

import ctypes
from pathlib import Path

from slide_fmu.fmu.build import RUNTIME, TARGETS, compile_objects, run_compiler

SOURCE = Path(__file__).parent / "c" / "kernel_time.c"
TARGET = TARGETS["x86_64-linux/slide.so"]


class KernelTime:
    """Times of one surrogate file, in seconds per step. Final.

    Args:
        payload: the surrogate file.
        folder: for the library; one that is there already is used.
    """

    def __init__(self, payload: Path, folder: Path) -> None:
        library = folder / "kernel_time.so"
        if not library.exists():
            objects = [str(path) for path in compile_objects(TARGET)]
            flags = ["-target", TARGET, "-std=c99", "-O3", "-fPIC", "-shared", f"-I{RUNTIME}"]
            run_compiler([*flags, str(SOURCE), *objects, "-lm", "-o", str(library)])
        self._library = ctypes.CDLL(str(library))
        self._path = str(payload).encode()

    def kernel(self, steps: int) -> float:
        """The network alone: one evaluation of layers, or both cells of a ping-pong step."""
        return self._call("kernel_seconds", steps)

    def features(self, steps: int) -> float:
        """What the network sees of an input."""
        return self._call("features_seconds", steps)

    def step(self, steps: int) -> float:
        """The whole step, history included, without the functions of FMI."""
        return self._call("step_seconds", steps)

    def read_step(self, steps: int) -> float:
        """The same with the error estimates read after it."""
        return self._call("read_seconds", steps)

    def _call(self, name: str, steps: int) -> float:
        function = getattr(self._library, name)
        function.restype = ctypes.c_double
        return float(function(self._path, steps))
