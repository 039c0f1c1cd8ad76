"""The house uses the field's words: idioms of its own become fewer, and sentences are whole."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = sorted(
    path for name in ("slide_fmu", "mbs_models") for path in (ROOT / name).rglob("*.py")
)

LINES = [
    (f"{path.relative_to(ROOT)}:{number}: ", line)
    for path in FILES
    for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1)
]

MOST = {
    r"[a-z_]*told": 0,
    r"said": 0,
    r"errs": 0,
    r"so many": 0,
    r"stretch(es)?": 2,  # both are names of former keys
    r"beside": 2,
}
"""Largest number of each idiom in Python: in names, docstrings, comments and messages. Lower a
number when a use has gone; never raise it. ``docs/contributing.md`` has the words instead."""

MOST_CLAUSES = 0
"""Largest number of module docstrings that begin with a clause instead of a sentence."""
CLAUSE = re.compile(r"(What|Whether|How|Which|Where|When|Who|Why)\b")
"""Beginning of such a docstring."""


def clauses() -> list[str]:
    """Return the modules whose docstrings begin with a clause."""
    docstrings = {path: ast.get_docstring(ast.parse(path.read_text("utf-8"))) for path in FILES}
    return [
        str(path.relative_to(ROOT))
        for path, text in docstrings.items()
        if CLAUSE.match(text or "")
    ]


@pytest.mark.parametrize(("idiom", "most"), MOST.items())
def test_idioms_of_the_house_become_fewer(idiom: str, most: int) -> None:
    pattern = re.compile(rf"\b{idiom}\b", re.IGNORECASE)
    found = [place + line.strip() for place, line in LINES for _ in pattern.findall(line)]
    assert len(found) <= most, "\n".join(found)


def test_every_package_has_a_docstring() -> None:
    packages = [path for path in FILES if path.name == "__init__.py"]
    empty = [
        path for path in packages if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert not empty, empty


def test_docstrings_of_modules_are_sentences() -> None:
    found = clauses()
    assert len(found) <= MOST_CLAUSES, "\n".join(found)
