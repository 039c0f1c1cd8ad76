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
TUTORIALS = sorted((DOCS / "gallery").glob("*.py"))
USER_PAGES = [page for page in PAGES if page.name not in FOR_DEVELOPERS | GENERATED]
MEDIAN, LONGEST = 15, 30
"""Largest number of words of the median and of the longest sentence of a page for users."""
MOST = {
    r"beside": 2,
    r"that of": 2,
    r"those of": 5,
    r"told": 1,
    r"said": 1,
    r"errs?": 1,
    r"as many( \w+)? as": 0,
    r"so many": 1,
    r"whoever": 0,
    r"stretch(es)?": 2,
    r"nobody": 0,
    r"anybody": 2,
}
"""Largest number of each idiom on pages, in tutorials and in the README. Lower a number when a use
has gone; never raise it. ``docs/contributing.md`` lists the idioms once, with better words."""


@cache
def text_of(page: Path) -> str:
    """Return a page in Markdown; the text of a tutorial stands in its docstring and comments."""
    text = page.read_text("utf-8")
    if page.suffix == ".md":
        return text
    comments = re.sub(
        r"^(?!#).*$|^# (?:--8<--|mkdocs_gallery).*$", "", text.split('"""')[2], flags=re.M
    )
    return text.split('"""')[1] + re.sub(r"^# ?(?:%%)?", "", comments, flags=re.M)


@pytest.mark.parametrize("page", [*USER_PAGES, *TUTORIALS], ids=lambda page: page.name)
def test_sentences_of_a_page_can_be_read_once(page: Path) -> None:
    found = sentences(text_of(page))
    too_long = [sentence for sentence in found if length(sentence) > LONGEST]
    assert too_long == []
    assert statistics.median(map(length, found) if found else [0]) <= MEDIAN


def test_words_of_a_page_are_counted_with_names_in_code_and_without_blocks_of_code() -> None:
    text = "# A title\n\nThe option `--json PATH`.\n\n```\nnot counted\n```\n"
    table = "\n| a | b |\n| --- | --- |\n| c | d |\n"
    assert words(text) == 2 + 4
    assert words(text + table) == 2 + 4 + 4


@cache
def prose_of(page: Path) -> str:
    """Return the prose of a page in one line."""
    return " ".join(prose(text_of(page)).split())


@pytest.mark.parametrize(("idiom", "most"), MOST.items())
def test_idioms_of_the_house_become_fewer(idiom: str, most: int) -> None:
    found = [
        f"{page.name}: ...{text[max(0, use.start() - 40) : use.end() + 20]}..."
        for page in [*PAGES, *TUTORIALS, ROOT / "README.md"]
        for text in [prose_of(page)]
        for use in re.finditer(rf"\b{idiom}\b", text, re.IGNORECASE)
    ]
    assert len(found) <= most, "\n".join(found)


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
