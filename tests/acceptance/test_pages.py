"""Links and names of files on pages lead somewhere, and formulas become MathML."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS))
try:
    from site_mathml import mathml
finally:
    sys.path.pop(0)

PAGES = sorted([*DOCS.glob("*.md"), *ROOT.glob("*.md"), ROOT / "training" / "README.md"])
NOW = [page for page in PAGES if page.name != "CHANGELOG.md"]
"""Pages that name only files which are there; the changelog also names those that are gone."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_of_a_page_lead_somewhere_in_a_clone(page: Path) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text("utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)\s#]+)[^)]*\)", text)
    local = [target for target in targets if not re.match(r"\w+:", target)]
    assert [target for target in local if not (page.parent / target).exists()] == []


@pytest.mark.parametrize("page", NOW, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_a_page_names_exist_or_are_to_be_made(page: Path) -> None:
    """Rows of the tables on adding things name new files as ``(new)``, or with NAME."""
    folders = "slide_fmu|mbs_models|tests|docs|fmus|training"
    for line in page.read_text("utf-8").splitlines():
        for name in re.findall(rf"`(?:\w+ )?((?:{folders})/[\w./]+)", line):
            assert (ROOT / name).exists() or "NAME" in name or "(new)" in line, name


def test_pages_show_what_they_show_without_being_built() -> None:
    raw = [page.name for page in PAGES if re.search(r"^ *--8<--", page.read_text("utf-8"), re.M)]
    assert raw == []


def test_formula_becomes_mathml_with_spaces_behind_functions() -> None:
    formula = mathml(r"\frac{\ln a}{2} \le \Re \lambda")
    space = '<mo form="prefix" lspace="0.17em" rspace="0.17em">'
    assert (
        f"<mfrac><mrow>{space}ln</mo><mi>a</mi></mrow><mrow><mn>2</mn></mrow></mfrac>" in formula
    )
    assert f"{space}Re</mo>" in formula


def test_formula_with_an_unknown_command_is_an_error() -> None:
    with pytest.raises(ValueError, match="does not know"):
        mathml(r"\unheard")
