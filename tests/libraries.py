"""What all test processes share is made once, also where two of them want it at once."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from slide_fmu.fmu.libraries.build import BUILD, build_all
from tests.time_log import of_no_file


@contextmanager
def one_process(lock: Path) -> Iterator[None]:
    """Let one test process at a time go on; the others wait until it is through.

    Args:
        lock: a file for it, whose folder is made.
    """
    lock.parent.mkdir(parents=True, exist_ok=True)
    with lock.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # closing the file gives it back
        yield


@cache
def build_libraries() -> None:
    """Compile the libraries of all platforms unless those of the present sources are there.

    Workers of pytest-xdist share the folders of the build: the first one that comes compiles, the
    others wait for it and then find the libraries.

    Raises:
        BuildError: the compiler is missing or refused the sources, with what it said.
    """
    with of_no_file(), one_process(BUILD / "tests.lock"):
        build_all()
