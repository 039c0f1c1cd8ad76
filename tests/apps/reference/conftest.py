"""Fixtures of FMUs that hold Python, and a finished run."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from tests.acceptance.conftest import bounded

__all__ = ["bounded"]


@pytest.fixture(autouse=True)
def unchanged_path() -> Iterator[None]:
    """PythonFMU leaves the folder of every instance on Python's search path."""
    before = list(sys.path)
    yield
    sys.path[:] = before
