"""Counts the words of the site and the lengths of its sentences.

``python docs/words.py`` prints, for each Markdown page, its words and its sentences: their number,
the median of their lengths and the longest one. ``python docs/words.py build/site`` prints the
words of each built page, with generated ones, and their sum. Blocks of code are not counted;
tables have words, and no sentences.
"""

from __future__ import annotations

import re
import statistics
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

import markdown

DOCS = Path(__file__).parent
EXTENSIONS = ["tables", "admonition", "attr_list", "md_in_html"]
EXTENSIONS += ["pymdownx.superfences", "pymdownx.blocks.tab", "pymdownx.arithmatex"]
OPTIONS = {
    "pymdownx.arithmatex": {"generic": True},
    "pymdownx.blocks.tab": {"alternate_style": True},
}
BLOCKS = {"p", "li", "dd", "dt", "td", "th", "label", "div", "figcaption", "h1", "h2", "h3", "h4"}
UNREAD = {"pre", "script", "style", "svg", "math", "button", "form"}
LEAST = 3
"""Fewer words than these make no sentence."""
END = re.compile(r"(?<=[.?!])[\"”)]*\s+(?=\S)")
WORD = re.compile(r"\w")
NO_PAGES = {"404.html", "robot_page.html", "drop.html"}


class Blocks(HTMLParser):
    """Pieces of text of a page, each with the elements that it stands in."""

    def __init__(self, html: str, code: bool) -> None:
        """Read a page; without ``code``, a name in code counts as one word ``x``."""
        super().__init__()
        self.unread = UNREAD if code else UNREAD | {"code"}
        self.open: list[str] = []
        self.found: list[tuple[list[str], str]] = []
        self.text = ""
        self.feed(html)
        self._end_block()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a block, or write one word for a piece of code or a formula."""
        if tag in BLOCKS:
            self._end_block()
        formula = ("class", "arithmatex") in attrs
        one_word = formula or tag == "math" or (tag == "code" and tag in self.unread)
        if one_word and not UNREAD & set(self.open):
            self.text += "x"
        if tag not in {"br", "img", "hr", "input", "link", "meta", "col", "source"}:
            self.open.append("math" if formula else tag)

    def handle_endtag(self, tag: str) -> None:
        """End what is open, with the block that it makes."""
        if tag in BLOCKS:
            self._end_block()
        if self.open:
            self.open.pop()

    def handle_data(self, data: str) -> None:
        """Keep what is read."""
        if not self.unread & set(self.open):
            self.text += data

    def _end_block(self) -> None:
        if self.text.strip(" \n¶"):
            self.found.append((list(self.open), self.text.strip(" \n¶")))
        self.text = ""


def prose(text: str) -> str:
    """Return all words of a page in Markdown, without code."""
    return "\n".join(found for _, found in _blocks(text))


def sentences(text: str) -> list[str]:
    """Return the sentences of a page in Markdown; headings, tables and labels have none."""
    return [
        sentence
        for inside, block in _blocks(text)
        if {"p", "li"} & set(inside) and not {"table", "label", "h1", "h2", "h3"} & set(inside)
        for sentence in END.split(" ".join(block.split()))
        if length(sentence) >= LEAST
    ]


def length(sentence: str) -> int:
    """Return the number of words of a sentence."""
    return sum(1 for word in sentence.split() if WORD.search(word))


def words(text: str) -> int:
    """Return the number of words of a page in Markdown; blocks of code are not counted."""
    return sum(length(found) for _, found in _blocks(text, code=True))


def words_of_site(site: Path) -> dict[str, int]:
    """Return the words of each page of a built site, code left out."""
    return dict(sorted(_words(site)))


def _blocks(text: str, code: bool = False) -> list[tuple[list[str], str]]:
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    text = re.sub(r"^:::.*$", "", text, flags=re.MULTILINE)  # the site puts documentation there
    html = markdown.markdown(text, extensions=EXTENSIONS, extension_configs=OPTIONS)
    return Blocks(html, code).found


def _words(site: Path) -> Iterator[tuple[str, int]]:
    for page in site.rglob("*.html"):
        if page.name not in NO_PAGES:
            (article,) = re.findall(r"<article.*?</article>", page.read_text("utf-8"), re.DOTALL)
            blocks = Blocks(article, code=True).found
            yield str(page.relative_to(site)), sum(length(text) for _, text in blocks)


def main() -> None:
    """Print what is counted."""
    if sys.argv[1:]:
        found = words_of_site(Path(sys.argv[1]))
        for name, count in found.items():
            print(f"{count:6d}  {name}")
        print(f"{sum(found.values()):6d}  words on {len(found)} pages")
        return
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text("utf-8")
        lengths = [length(sentence) for sentence in sentences(text)] or [0]
        middle = statistics.median(lengths)
        print(f"{page.name:24s} {words(text):4d} words, {len(lengths):4d} sentences, ", end="")
        print(f"median {middle:4.1f}, longest {max(lengths)}")


if __name__ == "__main__":
    main()
