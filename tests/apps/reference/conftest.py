"""Fixtures of FMUs that hold Python."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def unchanged_path() -> Iterator[None]:
    """PythonFMU leaves the folder of every instance on Python's search path."""
    before = list(sys.path)
    yield
    sys.path[:] = before
