"""The compiled runtime, built once for all tests, also where two processes want it at once."""

from __future__ import annotations

import fcntl
from functools import cache

from slide_fmu.fmu.libraries.build import BUILD, build_all


@cache
def build_libraries() -> None:
    """Compile the libraries of all platforms unless those of the present sources are there.

    Workers of pytest-xdist share the folders of the build: the first one that comes compiles, the
    others wait for it and then find the libraries.

    Raises:
        BuildError: the compiler is missing or refused the sources, with what it said.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "tests.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # closing the file gives it back
        build_all()
