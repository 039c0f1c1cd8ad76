"""Fixtures: the compiled runtime, and FMUs unpacked and loaded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest

from slide_fmu.fmu.build import build_all
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate import Surrogate

from .native import Loaded


@pytest.fixture(scope="session", autouse=True)
def _binaries() -> None:
    build_all()


@pytest.fixture
def load(tmp_path: Path) -> Callable[[Surrogate], Loaded]:
    """Export and unpack a surrogate."""

    def loaded(surrogate: Surrogate) -> Loaded:
        path = export_fmu(surrogate, tmp_path / f"{surrogate.name}.fmu")
        folder = Path(fmpy.extract(str(path), str(tmp_path / surrogate.name)))
        return Loaded(surrogate, path, folder)

    return loaded
