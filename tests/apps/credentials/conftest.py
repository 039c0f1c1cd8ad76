"""Fixtures: a released FMU, which carries credentials, and copies with one file changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.cosim.damage import members_of, packed
from tests.finer import finer, fmu, surrogate
from tests.libraries import build_libraries

__all__ = ["finer", "fmu", "surrogate"]

LINEAR = Path(__file__).parents[3] / "fmus" / "linear" / "linear.fmu"

Changed = Callable[[str, bytes | None], Path]
"""Gives a copy of the released FMU whose member has another content, or is missing if None."""


@pytest.fixture(scope="session", autouse=True)
def _binaries() -> None:
    build_libraries()


@pytest.fixture
def released() -> Surrogate:
    return read_fmu(LINEAR)[0]


@pytest.fixture
def changed(tmp_path: Path) -> Changed:
    def copy(member: str, content: bytes | None) -> Path:
        members = members_of(LINEAR)
        assert member in members
        others = {name: data for name, data in members.items() if name != member}
        path = tmp_path / "changed.fmu"
        path.write_bytes(packed(others if content is None else {**others, member: content}))
        return path

    return copy
