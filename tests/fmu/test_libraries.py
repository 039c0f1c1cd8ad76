"""The compiled libraries: those of the pinned compiler, and compiled once."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from slide_fmu.fmu.libraries import build


def test_unchanged_sources_are_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    libraries = build.build_all()
    monkeypatch.setattr(build, "run_compiler", lambda arguments: pytest.fail("compiled"))
    assert build.build_all() == libraries


def test_libraries_of_other_versions_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build.build_all()
    copy = tmp_path / "binaries"
    shutil.copytree(build.BINARIES, copy)
    whole = sorted(copy.rglob("*"))
    (copy / "linux64").mkdir()
    (copy / "linux64" / "slide.so").write_bytes(b"old")
    (copy / "x86_64-linux" / "slide.so.4711").write_bytes(b"broken off")
    monkeypatch.setattr(build, "BINARIES", copy)
    monkeypatch.setattr(build, "run_compiler", lambda arguments: pytest.fail("compiled"))
    build.build_all()
    assert sorted(copy.rglob("*")) == whole


def test_libraries_are_those_that_the_pinned_compiler_makes() -> None:
    """After a change of the runtime: python -m slide_fmu.fmu.libraries.build --record."""
    build.build_all()
    assert build.hashes() == build.HASHES.read_text()


def test_build_needs_the_standard_library_alone() -> None:
    code = "import runpy, sys; runpy.run_path(sys.argv[1]); assert 'numpy' not in sys.modules"
    script = str(Path(build.__file__))
    assert subprocess.run([sys.executable, "-c", code, script], check=False).returncode == 0
