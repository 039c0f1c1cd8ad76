"""This module writes the place of a mistake in a TOML file, with its line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from slide_fmu.core.toml_table import Table
from slide_fmu.recipe.reference import sections_of

Place = tuple[str | int, ...]
"""Keys, and indices of items of lists, from the outermost table of a file on."""

HEADER = re.compile(r"""\s*(\[\[?)\s*([\w."' -]+?)\s*\]\]?\s*(?:#.*)?$""")
"""A line that begins a table, or one of several."""
KEY = re.compile(r"""\s*([\w."' -]+?)\s*=""")
"""A line that gives a value to a key."""


@dataclass(frozen=True)
class RecipeFile:
    """A RecipeFile is the text of a recipe; its name and its lines stand in messages.

    Attributes:
        name: name of the file, or of another origin.
        text: what it holds; empty where it has no lines that a user could look up.
    """

    name: str
    text: str = ""

    def about(self, place: Place) -> str:
        """Write the file, the line and the key of a place, for the start of a message."""
        number = line_of(self.text, place)
        line = "" if number is None else f", line {number}"
        return f"{self.name}{line}: {in_words(place)}"


def without_forms(place: Place, file: type[Table] | None) -> tuple[Place, str]:
    """Return a place without names of forms, which pydantic adds to items of several forms.

    Args:
        place: the place of an error of pydantic.
        file: the outermost table of the file; None if its forms are unknown.

    Returns:
        The place, and the form of the innermost such item, or an empty text.
    """
    tables = [] if file is None else [s for s in sections_of(file) if s.tag is not None]
    kept: list[str | int] = []
    form = ""
    for count, part in enumerate(place, 1):
        item = count > 1 and isinstance(place[count - 2], int)
        if item and any(s.place[-1] == part and s.matches(place[:count]) for s in tables):
            form = str(part)
        else:
            kept.append(part)
    return tuple(kept), form


def in_words(place: Place, form: str = "", table: bool = False) -> str:
    """Write a place in words, such as ``5th [[data.excitation]] (sweep), key samples``.

    Args:
        place: a place without names of forms.
        form: form of the innermost item of a list of tables.
        table: whether an item at the place's end is a table.
    """
    words: list[str] = []
    keys: list[str] = []
    for index, part in enumerate(place):
        if not isinstance(part, int):
            keys.append(part)
            continue
        name, last = ".".join(keys), index == len(place) - 1
        if table if last else isinstance(place[index + 1], str):
            words.append(f"{ordinal(part + 1)} [[{name}]]")
        else:
            of = f"of {name}" if name else f"in the {words.pop()}"
            words.append(f"{ordinal(part + 1)} value {of}")
        keys = []
    if words and form:
        words[-1] += f" ({form})"
    if not words:
        return ".".join(keys)
    return ", ".join([*words, *([f"key {'.'.join(keys)}"] if keys else [])])


def ordinal(number: int) -> str:
    """Write 1st, 2nd, 3rd, 4th."""
    ends = {1: "st", 2: "nd", 3: "rd"}
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ends.get(number % 10, 'th')}"


def line_of(text: str, place: Place) -> int | None:
    """Return the line of a TOML text, from 1, where a place begins; None where it is not found.

    A missing place, or a place within a line, has the line of its table or key.
    """
    inside: Place = ()
    counts: dict[Place, int] = {}
    line_number, known = None, 0
    for number, line in enumerate(text.splitlines(), 1):
        header, key = HEADER.match(line), KEY.match(line)
        if header is not None:
            inside = _with_indices(_keys(header[2]), counts)
            if header[1] == "[[":
                counts[inside] = counts.get(inside, -1) + 1
                inside = (*inside, counts[inside])
            here = inside
        elif key is not None:
            here = (*inside, *_keys(key[1]))
        else:
            continue
        if len(here) > known and here == place[: len(here)]:
            line_number, known = number, len(here)
    return line_number


def _keys(text: str) -> list[str]:
    """Split a dotted name into its keys."""
    return [part.strip(" \"'") for part in text.split(".")]


def _with_indices(keys: Sequence[str], counts: dict[Place, int]) -> Place:
    """Return the place of a table; in lists of tables it lies in the last one so far."""
    place: Place = ()
    for index, key in enumerate(keys):
        place = (*place, key)
        if place in counts and index < len(keys) - 1:
            place = (*place, counts[place])
    return place
