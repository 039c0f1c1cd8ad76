"""The site's page on recipes is written here, from the typed tables of the package."""

from __future__ import annotations

from collections.abc import Iterable

from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.reference import ITEM, Key, Section, about, sections_of

HEADING = """# Every key of a recipe

A recipe is a TOML file that says everything which makes a surrogate. `slide-fmu init` writes a
first one. Most keys may be left out: then the default counts, and `"auto"` means that the value is
found from the system. `name`, `description`, `system.model` and `window.step` must be there.

A value of another type is refused (`true` is no number, and `"3"` neither), and so is a key that
this page does not have. The message says which key may be meant.

This page is made from the package itself, by the build of the site.
"""


def recipe_page() -> str:
    """Return the page in Markdown: one table of keys for each table of a recipe."""
    return "\n".join([HEADING, *(_section_text(group) for group in _groups())])


def _groups() -> Iterable[list[Section]]:
    """Return the sections in their order; those of the same table stand together."""
    groups: dict[type, list[Section]] = {}
    for section in sections_of(Recipe):
        groups.setdefault(section.table, []).append(section)
    return groups.values()


def _section_text(group: list[Section]) -> str:
    """Return a heading, what the table is, and its keys."""
    names = ", ".join(dict.fromkeys(map(_name, group)))
    rows = "\n".join(map(_row, group[0].keys))
    return (
        f"## {names}\n\n{about(group[0].table)}\n\n"
        f"| key | type | default | meaning |\n| --- | --- | --- | --- |\n{rows}\n"
    )


def _name(section: Section) -> str:
    """Return how a table begins in a file, with the key that chooses its form."""
    if not section.place:
        return "Keys before all tables"
    form = "" if section.tag is None else f' with `{section.tag[0]} = "{section.tag[1]}"`'
    parts = section.place if section.tag is None else section.place[:-1]
    name = ".".join(part for part in parts if part != ITEM)
    return f"`[[{name}]]`{form}" if ITEM in parts else f"`[{name}]`{form}"


def _row(key: Key) -> str:
    default = f"`{key.default}`" if key.default[:1] in ('"', "[", "{") else key.default
    cells = (f"`{key.name}`", key.type, default, key.meaning)
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
