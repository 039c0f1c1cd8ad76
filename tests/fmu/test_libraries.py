"""The compiled libraries: those of the pinned compiler, and compiled once."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import slide_fmu as slide
from slide_fmu.fmu import native_library
from slide_fmu.fmu.libraries import build, platforms
from tests.recipes import TINY
from tests.refusals import refused


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


@pytest.fixture
def old_libraries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Libraries whose sources were changed since."""
    build.build_all()
    copy = tmp_path / "binaries"
    shutil.copytree(build.BINARIES, copy)
    (copy / build.STAMP).write_text("0" * 64)
    monkeypatch.setattr(platforms, "BINARIES", copy)


OLD = ("is older than its sources", "python -m slide_fmu.fmu.libraries.build")


@pytest.mark.usefixtures("old_libraries")
def test_libraries_that_are_older_than_their_sources_are_not_used() -> None:
    with refused(platforms.OldLibrariesError, *OLD):
        platforms.compiled("x86_64-linux/slide.so")
    with refused(platforms.OldLibrariesError, *OLD):
        native_library.load_library()


@pytest.mark.usefixtures("old_libraries")
def test_libraries_of_an_installed_package_are_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platforms, "CLONE", tmp_path)
    assert platforms.compiled("x86_64-linux/slide.so")


@pytest.mark.usefixtures("old_libraries")
def test_run_says_before_any_work_that_libraries_are_older_than_their_sources(
    tmp_path: Path,
) -> None:
    recipe = tmp_path / "tiny.toml"
    recipe.write_text(TINY, encoding="utf-8")
    with refused(platforms.OldLibrariesError, *OLD):
        slide.run(recipe, runs=tmp_path / "runs")
    assert not list(tmp_path.glob("runs/*/*"))


def test_build_needs_the_standard_library_alone() -> None:
    code = "import runpy, sys; runpy.run_path(sys.argv[1]); assert 'numpy' not in sys.modules"
    script = str(Path(build.__file__))
    assert subprocess.run([sys.executable, "-c", code, script], check=False).returncode == 0
