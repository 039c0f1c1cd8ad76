"""Tests of an app lie in the folder of its name, and are left out where the app was removed."""

from __future__ import annotations

from pathlib import Path

from tests.marks import APPS

HERE = Path(__file__).parent

collect_ignore = [
    path.name
    for path in HERE.iterdir()
    if (path / "__init__.py").exists() and not (APPS / path.name / "__init__.py").exists()
]
