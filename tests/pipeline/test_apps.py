"""Apps that cannot be used are named, and what they take part in goes on without the others."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from slide_fmu.pipeline import apps as registry
from slide_fmu.pipeline.apps import App, AppError, apps, subcommands_of_apps
from tests.refusals import refused

NOWHERE = "slide_fmu.report.quality"


@pytest.fixture(autouse=True)
def _apps_of_the_test_are_forgotten() -> object:
    apps.cache_clear()
    yield
    apps.cache_clear()


@pytest.mark.parametrize(
    ("value", "word"),
    [
        ("slide_fmu.nowhere:APP", "No module named"),
        (f"{NOWHERE}:APP", "has no attribute 'APP'"),
        (f"{NOWHERE}:QualityError", "QualityError"),
    ],
)
def test_app_that_cannot_be_loaded_is_named_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch, value: str, word: str
) -> None:
    entry = EntryPoint("broken", value, registry.GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: [entry])
    with pytest.raises(AppError) as error:
        apps()
    assert all(part in str(error.value) for part in ("'broken'", word, "uninstall it"))


@pytest.mark.parametrize(
    ("found", "word"),
    [
        ({"one": App(subcommands={"absent": NOWHERE})}, "absent"),
        (
            {
                "one": App(subcommands={"QualityError": NOWHERE}),
                "two": App(subcommands={"QualityError": NOWHERE}),
            },
            "is a subcommand",
        ),
    ],
)
def test_subcommand_that_is_not_there_or_there_twice_is_refused(
    monkeypatch: pytest.MonkeyPatch, found: dict[str, App], word: str
) -> None:
    monkeypatch.setattr(registry, "apps", lambda: found)
    with pytest.raises(AppError, match=word):
        subcommands_of_apps()


def test_app_cannot_take_the_name_of_a_subcommand(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "apps", lambda: {"one": App(subcommands={"run": NOWHERE})})
    with refused(AppError, "'one'", "a subcommand 'run' already"):
        subcommands_of_apps(["init", "run"])


def test_broken_app_leaves_the_other_subcommands(tmp_path: Path) -> None:
    """A package of others that raises anything while it is imported."""
    (tmp_path / "broken_app.py").write_text("raise ZeroDivisionError('oh')\n", encoding="utf-8")
    place = tmp_path / "broken-1.dist-info"
    place.mkdir()
    (place / "METADATA").write_text("Name: broken\nVersion: 1\n", encoding="utf-8")
    row = f"[{registry.GROUP}]\nbroken = broken_app:APP\n"
    (place / "entry_points.txt").write_text(row, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "slide_fmu", "--version"],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith("slide-fmu ")
    assert all(part in done.stderr for part in ("remark:", "'broken'", "ZeroDivisionError: oh"))
    assert "Traceback" not in done.stderr
