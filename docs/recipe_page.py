"""Writes the page of the site about all keys of a recipe, from the typed tables of the package.

Run ``python docs/recipe_page.py`` after a change of these tables; a test compares the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from slide_fmu.recipe.learning import METHODS
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.reference import ITEM, Key, Section, about, sections_of

PAGE = Path(__file__).parent / "recipe.md"
HEADING = """# Every key of a recipe

A recipe is a TOML file with all settings of a surrogate. `slide-fmu init` writes a first one. Most
keys may be left out. They then have their default, or are found from the system, as with `"auto"`.
Only `name`, `description`, `system.model` and `window.step` must be given, and ranges of signals
that the model does not give.

Unknown keys and values of another type are refused: `true` is no number, and `"3"` is none either.
The message names the nearest known key.
"""
EXCITATION = """## Excitation

Tables `[[data.excitation]]` give the kinds of input for the training.
`[[training.expert.excitation]]` adds kinds to learn from, `[[bound.excitation]]` kinds for the
error bound, and `[[validation.excitation]]` kinds that are only measured. Each table has these two
keys, and the keys of its kind:

"""
TABLE = "| key | type | default | meaning |\n| --- | --- | --- | --- |\n"
SHARED = ("kind", "weight")
"""Keys of every kind of excitation; they stand in one table."""
FAMILIES = {method: family for family, method in METHODS.items()}
"""Families of networks by their method of training, which no file names."""
SHORTER = (
    (r"list of (\d+): (.+?) each", "\\1 \u00d7 \\2"),
    (r"list: (.+?) each", r"list of \1"),
    (r"(table(?:: table)*): (.+?) for each name(?: for each name)?", r"table of \2"),
    ("whole number", "integer"),
    (r" from (-?[\d.]+) to ", r" \1 .. "),
    (" from ", " ≥ "),
    (" above ", " > "),
    (" below ", " < "),
    ("true or false", "boolean"),
    (r"(number|integer) > (\S+) < (\S+)", r"\2 < \1 < \3"),
    (r"(number|integer) ≥ (\S+) < (\S+)", r"\2 ≤ \1 < \3"),
    (r"(number|integer) > (\S+) to (\S+)", r"\2 < \1 ≤ \3"),
)


def recipe_page() -> str:
    """Return the page in Markdown: one table of keys for each table of a recipe."""
    parts, excitation, of_kinds = [HEADING], False, dict[str, str]()
    for group in _groups():
        if _is_excitation(group[0]) and not excitation:
            weight = [key for key in group[0].keys if key.name == "weight"]
            kind = Key("kind", "text", "must be given", "Name of the kind; required.")
            parts.append(f"{EXCITATION}{TABLE}{_rows([kind, *weight])}\n")
            excitation = True
        parts.append(_section_text(group, of_kinds))
    return "\n".join(parts)


def _groups() -> Iterable[list[Section]]:
    """Return the sections in their order; those of the same table stand together."""
    groups: dict[type, list[Section]] = {}
    for section in sections_of(Recipe):
        groups.setdefault(section.table, []).append(section)
    return groups.values()


def _is_excitation(section: Section) -> bool:
    return section.tag is not None and section.tag[0] == "kind"


def _section_text(group: list[Section], of_kinds: dict[str, str]) -> str:
    """Return a heading, what the table is, and its keys.

    ``of_kinds`` names the kind of excitation that has a meaning first; others refer to it.
    """
    first, keys = group[0], group[0].keys
    heading, text = f"## {', '.join(dict.fromkeys(map(_name, group)))}", f"{about(first.table)}\n"
    if _is_excitation(first) and first.tag is not None:
        kind = first.tag[1]
        heading = f'### Kind `"{kind}"`'
        keys = tuple(_referring(key, kind, of_kinds) for key in keys if key.name not in SHARED)
    elif not first.place:
        text = ""  # the page begins with it
    rows = _rows(keys)
    parts = (f"{heading}\n", text, f"{TABLE}{rows}\n" if rows else "")
    return "\n".join(part for part in parts if part)


def _referring(key: Key, kind: str, of_kinds: dict[str, str]) -> Key:
    """Return a key whose meaning stands in the table of the first kind that has it."""
    first = of_kinds.setdefault(key.meaning, kind)
    return key if first == kind else replace(key, meaning=f'As for `"{first}"`.')


def _name(section: Section) -> str:
    """Return how a table begins in a file, with the key that chooses its form."""
    if not section.place:
        return "Keys before all tables"
    family = next((FAMILIES[part] for part in section.place if part in FAMILIES), None)
    form = ""
    if family is not None:
        form = f' for `network.family = "{family}"`'
    elif section.tag is not None:
        form = f' with `{section.tag[0]} = "{section.tag[1]}"`'
    parts = section.place if section.tag is None or family else section.place[:-1]
    name = ".".join(part for part in parts if part != ITEM and part not in FAMILIES)
    return f"`[[{name}]]`{form}" if ITEM in parts else f"`[{name}]`{form}"


def short_type(text: str) -> str:
    """Write a type with signs in the place of words."""
    for long, short in SHORTER:
        text = re.sub(long, short, text)
    return text


def _rows(keys: Sequence[Key]) -> str:
    """Return a row for each key; a meaning that several keys share stands once."""
    rows = []
    for before, key in zip([None, *keys], keys, strict=False):
        same = before is not None and before.meaning == key.meaning
        default = f"`{key.default}`" if key.default[:1] in ('"', "[", "{") else key.default
        meaning = "As above." if same else key.meaning
        cells = (f"`{key.name}`", short_type(key.type), default, meaning)
        rows.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(rows)


if __name__ == "__main__":
    PAGE.write_text(recipe_page(), encoding="utf-8")
