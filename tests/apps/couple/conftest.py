"""Fixtures: the halves of a quarter car, once for all tests."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.own_models.halves.cut_car import write_halves


@pytest.fixture(autouse=True)
def unchanged_path() -> Iterator[None]:
    """PythonFMU leaves the folder of every instance on Python's search path."""
    before = list(sys.path)
    yield
    sys.path[:] = before


@pytest.fixture(autouse=True)
def in_this_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all FMUs run in this program, which saves half a second in each run."""
    monkeypatch.setattr("slide_fmu.apps.couple.couple.is_foreign", lambda system: False)


@pytest.fixture(scope="session")
def halves(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Both halves, which can go back to a former state."""
    return write_halves(tmp_path_factory.mktemp("halves"))
