"""Apps that cannot be used are named, and what they take part in goes on without the others."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import pytest

import slide_fmu as slide
from slide_fmu.pipeline import apps as registry
from slide_fmu.pipeline.apps import App, apps, subcommands_of_apps, unusable_apps
from tests.marks import needs_app

NOWHERE = "slide_fmu.report.quality"


@pytest.fixture(autouse=True)
def _apps_of_the_test_are_forgotten() -> object:
    registry._installed.cache_clear()
    yield
    registry._installed.cache_clear()


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
    broken = EntryPoint("broken", value, registry.GROUP)
    others = list(entry_points(group=registry.GROUP))
    monkeypatch.setattr(registry, "entry_points", lambda group: [broken, *others])
    assert set(apps()) == {other.name for other in others}
    (reason,) = unusable_apps()
    assert all(part in reason for part in ("'broken'", word, "uninstall it"))
    assert not hasattr(slide, "nothing")
    with pytest.raises(AttributeError, match="'broken'"):
        _ = slide.nothing


@pytest.mark.parametrize(
    ("found", "word"),
    [
        ({"one": App(subcommands={"absent": NOWHERE})}, "absent"),
        ({"one": App(subcommands={"run": NOWHERE})}, "a subcommand 'run' already"),
        (
            {
                "a": App(subcommands={"QualityError": NOWHERE}),
                "one": App(subcommands={"QualityError": NOWHERE}),
            },
            "a subcommand 'QualityError' already",
        ),
    ],
)
def test_subcommand_that_is_not_there_or_there_twice_is_left_out(
    monkeypatch: pytest.MonkeyPatch, found: dict[str, App], word: str
) -> None:
    good = {"good": App(subcommands={"percent": "slide_fmu.core.measures"})}
    monkeypatch.setattr(registry, "apps", lambda: {**found, **good})
    subcommands, (reason,) = subcommands_of_apps(["init", "run"])
    assert "percent" in subcommands
    assert all(part in reason for part in ("'one'", word))


@pytest.mark.extended
@pytest.mark.parametrize(
    "arguments",
    [
        ["--version"],
        ["check", "fmus/duffing/duffing.fmu"],
        pytest.param(["bench", "--help"], marks=needs_app("bench")),
    ],
)
def test_broken_app_leaves_the_rest_of_slide_fmu(tmp_path: Path, arguments: list[str]) -> None:
    """A package of others that raises anything while it is imported."""
    (tmp_path / "broken_app.py").write_text("raise ZeroDivisionError('oh')\n", encoding="utf-8")
    place = tmp_path / "broken-1.dist-info"
    place.mkdir()
    (place / "METADATA").write_text("Name: broken\nVersion: 1\n", encoding="utf-8")
    row = f"[{registry.GROUP}]\nbroken = broken_app:APP\n"
    (place / "entry_points.txt").write_text(row, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "slide_fmu", *arguments],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("remark: the app 'broken'") == 1
    assert "ZeroDivisionError: oh" in done.stderr
    assert "Traceback" not in done.stderr
