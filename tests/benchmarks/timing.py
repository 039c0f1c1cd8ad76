"""Parts of a communication step of the C runtime, timed inside C.

The shipped library has no entry points for timing: ``c/parts.c`` is compiled here, by the pinned
compiler, together with the objects of the runtime, for Linux on x86-64.
"""

from __future__ import annotations

import ctypes
import enum
import fcntl
import hashlib
import time
import weakref
from functools import cache
from pathlib import Path

from slide_fmu.fmu.libraries.build import (
    BUILD,
    CODE,
    FAST,
    RUNTIME,
    TARGETS,
    WARNINGS,
    compile_objects,
    digest,
    include_flags,
    run_compiler,
)
from slide_fmu.surrogate.surrogate import Surrogate

SOURCE = Path(__file__).parent / "c" / "parts.c"
CHOICE = RUNTIME / "kernel" / "kernel_choice.c"
LOOP_SECONDS, MOST_LOOPS = 4e-4, 2000
"""A loop inside C is short enough to run undisturbed, and much longer than calling it."""


class Part(enum.IntEnum):
    """A part of a communication step, repeated and timed; the numbers are those of ``parts.c``."""

    NETWORK = 0
    """One evaluation of all that layers give, or both cells of a step."""
    FEATURES = 1
    """What the surrogate's network sees of an input."""
    STEP = 2
    """A communication step without FMI."""
    STEP_AND_READ = 3
    """The same with all that it says of its error read."""
    READ_MEMORY = 4
    """Each byte of the network read once, as fast as can be."""


class TimedSurrogate:
    """A surrogate whose parts of a step can be repeated in C.

    Args:
        surrogate: whose steps are timed.
        narrow: by the kernel for vectors of four numbers that each x86-64 has, instead of the best
            one of this processor.

    Raises:
        BuildError: the compiler refused the sources.
        ValueError: the runtime refused the surrogate.
    """

    def __init__(self, surrogate: Surrogate, narrow: bool = False) -> None:
        self._library, self._payload = _library(narrow), surrogate.to_bytes()
        size = ctypes.c_size_t(len(self._payload))
        handle = self._library.parts_open(self._payload, size)
        if not handle:
            raise ValueError(f"surrogate {surrogate.name!r}: the runtime refused it")
        self._handle = ctypes.c_void_p(handle)
        weakref.finalize(self, self._library.parts_close, self._handle)

    @property
    def memory(self) -> int:
        """Bytes that ``Part.READ_MEMORY`` reads: the network as the kernels have it."""
        return int(self._library.parts_memory(self._handle))

    def repeat(self, part: Part, times: int) -> None:
        """Run a part of a communication step over and over.

        Raises:
            ValueError: a result is not finite.
        """
        if self._library.parts_repeat(self._handle, int(part), times) != 0:
            raise ValueError(f"{part.name}: a result is not finite")


def part_times(timed: TimedSurrogate, part: Part, loops: int, times: int) -> list[float]:
    """Seconds of a part of a step inside C, one for each of the loops.

    Args:
        timed: the surrogate.
        part: what is timed.
        loops: how often it is timed.
        times: repetitions in each loop.
    """
    found = []
    for _ in range(loops):
        begin = time.perf_counter()
        timed.repeat(part, times)
        found.append((time.perf_counter() - begin) / times)
    return found


def repeats(timed: TimedSurrogate, part: Part) -> int:
    """How many repetitions make a loop that runs undisturbed."""
    (seconds,) = part_times(timed, part, 1, 20)
    return min(MOST_LOOPS, max(1, int(LOOP_SECONDS / seconds)))


def _compile(target: str, narrow: bool, path: Path) -> None:
    objects = [str(file) for file in compile_objects(target)]
    if narrow:
        objects = [file for file in objects if Path(file).stem != CHOICE.stem]
        objects += ["-DSLIDE_ONE_KERNEL", str(CHOICE)]
    # for this processor: reading is to be as fast as its memory, not as its oldest relative
    fast = [FAST, "-mcpu=native"]
    flags = ["-target", target, *fast, *WARNINGS, *CODE, *include_flags(), "-fPIC", "-shared"]
    run_compiler([*flags, str(SOURCE), *objects, "-lm", "-o", str(path)])


@cache
def _library(narrow: bool) -> ctypes.CDLL:
    """The runtime with ``parts.c``, compiled once for each state of the sources."""
    target = TARGETS["x86_64-linux/slide.so"]
    key = hashlib.sha256(
        digest().encode() + SOURCE.read_bytes() + Path(__file__).read_bytes()
    ).hexdigest()[:16]
    path = BUILD / f"parts-{key}{'-narrow' if narrow else ''}.so"
    path.parent.mkdir(parents=True, exist_ok=True)
    with (BUILD / "tests.lock").open("w") as lock:  # other processes compile the same objects
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.is_file():
            _compile(target, narrow, path)
    library = ctypes.CDLL(str(path))
    library.parts_open.restype = ctypes.c_void_p
    library.parts_memory.restype = ctypes.c_size_t
    library.parts_close.restype = None
    return library
