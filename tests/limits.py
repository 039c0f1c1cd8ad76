"""Limits of the machine made small, and how long a program may take."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager

HANGS = 900.0
"""Time in s after which a program of a test is taken to hang; far more than any takes on a machine
that is busy."""


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """No file may become larger, in bytes: as if the disk were full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
