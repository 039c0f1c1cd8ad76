"""Links and formulas of the documentation lead somewhere, and are built."""

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

PAGES = sorted(DOCS.glob("*.md"))


@pytest.mark.parametrize("page", [*PAGES, *ROOT.glob("*.md")], ids=lambda page: page.name)
def test_links_of_a_page_lead_somewhere_in_a_clone(page: Path) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text("utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)\s#]+)[^)]*\)", text)
    local = [target for target in targets if not re.match(r"\w+:", target)]
    assert [target for target in local if not (page.parent / target).exists()] == []


def test_pages_show_what_they_show_without_being_built() -> None:
    raw = [page.name for page in PAGES if re.search(r"^ *--8<--", page.read_text("utf-8"), re.M)]
    assert raw == []


def test_formula_becomes_mathml_with_spaces_behind_functions() -> None:
    found = mathml(r"\frac{\ln a}{2} \le \Re \lambda")
    space = '<mo form="prefix" lspace="0.17em" rspace="0.17em">'
    assert f"<mfrac><mrow>{space}ln</mo><mi>a</mi></mrow><mrow><mn>2</mn></mrow></mfrac>" in found
    assert f"{space}Re</mo>" in found


def test_formula_with_an_unknown_command_is_an_error() -> None:
    with pytest.raises(ValueError, match="does not know"):
        mathml(r"\unheard")
