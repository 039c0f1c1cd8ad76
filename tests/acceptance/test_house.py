"""Packages, files, classes and apps keep to the rules of ``docs/contributing.md``."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "slide_fmu"
APPS = sorted(path.parent for path in PACKAGE.glob("apps/*/__init__.py"))
NAMES = {
    *("measured", "given", "alike", "meeting", "patience", "lasting", "way", "grip", "lamp"),
    *("utils", "helpers", "misc", "common"),
}
"""These names do not say what is in a file."""


def test_names_of_files_say_what_is_in_them() -> None:
    files = [path for end in ("py", "js", "c", "h") for path in PACKAGE.rglob(f"*.{end}")]
    assert [str(path.relative_to(ROOT)) for path in files if path.stem in NAMES] == []


def test_public_names_of_classes_have_one_meaning() -> None:
    homes: dict[str, list[str]] = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    found = {name: sorted(files) for name, files in homes.items() if len(files) > 1}
    assert found == {}


def test_every_app_has_one_row_and_every_row_its_app() -> None:
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    _, _, rest = text.partition('[project.entry-points."slide_fmu.apps"]\n')
    rows = rest.split("\n\n")[0].strip().splitlines()
    assert rows == [f'{app.name} = "slide_fmu.apps.{app.name}.app:APP"' for app in APPS]


def test_every_package_has_a_docstring() -> None:
    packages = [
        p for name in ("slide_fmu", "mbs_models") for p in (ROOT / name).rglob("__init__.py")
    ]
    empty = [
        path for path in packages if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert not empty, empty
