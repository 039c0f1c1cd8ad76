"""This module writes each mistake in a TOML file on one line, with key, value and remedy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from slide_fmu.core.mistakes import WITHIN, causes, expectation, meant_choice, value_text
from slide_fmu.core.suggestions import nearest, or_meant
from slide_fmu.core.toml_table import Table
from slide_fmu.recipe.automatic import AUTO, AUTOMATIC
from slide_fmu.recipe.learning import METHODS
from slide_fmu.recipe.places import Place, in_words, line_of, without_forms
from slide_fmu.recipe.reference import ITEM, NAME, known_keys, sections_of

LIST = re.compile(r"list(?: of (\d+))?: ((?:whole )?number\b[^,:]*|text) each")
"""Types of keys that are lists of numbers or of texts."""
SPELLING = 0.8
"""Likeness from which a key is a misspelt one of its table, even if another table has it."""
MOST_TABLES = 3
"""Largest number of tables that a message names for a key of other tables."""


def mistake_lines(
    error: ValidationError,
    source: str,
    whole: str = "recipe",
    file: type[Table] | None = None,
    text: str = "",
) -> str:
    """Write the mistakes in a TOML file, one line for each.

    Args:
        error: the error of pydantic.
        source: name of the file in messages.
        whole: kind of the file, for mistakes that belong to no single key.
        file: the outermost table of the file, whose keys are suggested for misspelt ones.
        text: content of the file, for numbers of lines; empty without a file.
    """
    every = causes(error)
    shown, places = _without_misspelt(every, file), {item["loc"] for item in every}
    if not places.isdisjoint({("window",), ("window", "step")}):
        # the mix of inputs follows from the step, so it is missing for that reason alone
        shown = [item for item in shown if item["loc"] not in {("data",), ("data", "excitation")}]
    return "\n".join(
        f"{source}{_line(text, item, file)}: {_describe(item, whole, file)}" for item in shown
    )


def _without_misspelt(items: list[Any], file: type[Table] | None) -> list[Any]:
    """Leave out that a key is missing where another mistake is its misspelt name."""
    meant = {
        (*item["loc"][:-1], nearest(str(item["loc"][-1]), known_keys(file, item["loc"][:-1])))
        for item in items
        if item["type"] == "extra_forbidden" and file is not None
    }
    return [item for item in items if item["type"] != "missing" or item["loc"] not in meant]


def _line(text: str, item: Any, file: type[Table] | None) -> str:
    """Return the text ``, line 12`` to follow the name of a file, where the line is known."""
    tag = [item["ctx"]["discriminator"].strip("'")] if item["type"].startswith("union_") else []
    number = line_of(text, (*_place(item, file)[0], *tag))
    return "" if number is None else f", line {number}"


def _place(item: Any, file: type[Table] | None) -> tuple[Place, str]:
    """Return the place of a mistake in the file, and the form of the table that it is in."""
    parts = [part for part in item["loc"] if part != "[key]"]  # pydantic's own word
    parts += item.get("ctx", {}).get(WITHIN, [])
    if parts[:1] in (["network"], ["training"]):  # the union's choice is not part of the key
        parts[1:2] = [part for part in parts[1:2] if part not in (*METHODS, *METHODS.values())]
    return without_forms(tuple(parts), file)


def _describe(item: Any, whole: str, file: type[Table] | None) -> str:
    parts, form = _place(item, file)
    place = in_words(parts, form, table=isinstance(item["input"], dict)) or whole
    if item["type"] == "union_tag_not_found":
        key = item["ctx"]["discriminator"].strip("'")
        return f"{in_words((*parts, key))} is missing"
    if item["type"] == "union_tag_invalid":
        context = item["ctx"]
        key = context["discriminator"].strip("'")
        expected = context["expected_tags"]
        meant = meant_choice(str(context["tag"]), expected)
        at = in_words((*parts, key))
        return f"{at} = {context['tag']!r}; expected one of {expected}{meant}"
    if item["type"] == "missing" and isinstance(item["loc"][-1], int):  # of a list
        place, n = in_words(parts[:-1], form), len(item["input"])
        return f"{place} = {value_text(item['input'])}: expected more than {n} value{'s'[: n - 1]}"
    if item["type"] == "missing":
        return f"{place} is missing"
    if item["type"] == "extra_forbidden":
        return f"{place} {_unknown_key(item['loc'], file)}"
    message = item.get("several") or expectation(item)
    if item["type"] == "tuple_type" and file is not None:
        message += _example(tuple(item["loc"]), item["input"], file)
    if place in AUTOMATIC:
        message += f', or "{AUTO}"' + or_meant(str(item["input"]), [AUTO])
    if isinstance(item["input"], dict):  # a whole table: the message names its values
        return f"{place}: {message}"
    return f"{place} = {value_text(item['input'])}: {message}"


def _example(place: Place, given: Any, file: type[Table]) -> str:
    """Return an ending that shows how the list at a place is written.

    Args:
        place: the place, with forms of tables.
        given: the value that stands there in place of a list.
        file: the outermost table of the file.
    """
    sections = list(sections_of(file))
    if any(s.place[: len(place) + 1] == (*place, ITEM) for s in sections):
        return f": write [[{'.'.join(map(str, place))}]] at the head of each of its tables"
    inner = [s for s in sections if s.matches(place[:-1])]
    (kind,) = [key.type for s in inner for key in s.keys if key.name == place[-1]][:1] or [""]
    match = LIST.fullmatch(kind)
    if match is None:
        return ""
    wanted = int | float if "number" in match[2] else str
    item = given if isinstance(given, wanted) else 1 if "number" in match[2] else "text"
    return f", such as {value_text([item] * int(match[1] or 1))}"


def _unknown_key(place: tuple[str | int, ...], file: type[Table] | None) -> str:
    """Write that a key is not known, and which key may be meant.

    Args:
        place: the key's place in the file, its own name last.
        file: the outermost table of the file; without it, no key is suggested.
    """
    *table, key = place
    if file is not None and (other := _of_other_forms(tuple(table), str(key), file)):
        return other
    known = known_keys(file, tuple(table)) if file is not None else []
    elsewhere = [] if file is None else _tables_with(str(key), file)
    own = f"[{'.'.join(str(part) for part in _without_methods(table))}.expert]"
    misspelt = nearest(str(key), known, SPELLING)
    elsewhere = [own] if own in elsewhere else [] if misspelt else elsewhere[:MOST_TABLES]
    if elsewhere:
        return f"is not a known key; {key} is one of {' and '.join(elsewhere)}: move or remove it"
    meant = nearest(str(key), known)
    if meant is not None:
        return f"is not a known key; did you mean {meant}? Correct its spelling, or remove it"
    return "is not a known key; remove it or correct its spelling"


def _of_other_forms(table: tuple[str | int, ...], key: str, file: type[Table]) -> str | None:
    """Write that a key belongs to a table of another form, such as another family; else None.

    Args:
        table: the table's place in the file, its form last, as ``("network", "state_space")``.
        key: the key that it does not have.
        file: the outermost table of the file.
    """
    alike = [s for s in sections_of(file) if s.tag and s.matches((*table[:-1], s.tag[1]))]
    forms = [s.tag[1] for s in alike if s.tag and key in [each.name for each in s.keys]]
    if not table or not forms or table[-1] not in [s.tag[1] for s in alike if s.tag]:
        return None
    (name,) = {s.tag[0] for s in alike if s.tag}
    form = str(table[-1])
    if table[0] == "training":  # its form follows from the family of the network
        families = {method: family for family, method in METHODS.items()}
        name, form, forms = "network.family", families[form], [families[f] for f in forms]
    switch = "network.family" if table[0] in ("network", "training") else name
    return (
        f"is not a known key where {name} = {form!r}, only where it is "
        f"{' or '.join(map(repr, forms))}: remove it, or choose another {switch}"
    )


def _tables_with(key: str, file: type[Table]) -> list[str]:
    """Return the names of a file's tables that have a key, without items of lists."""
    places = [s.place for s in sections_of(file) if key in [each.name for each in s.keys]]
    named = [
        f"[{'.'.join(_without_methods(place))}]"
        for place in places
        if place and NAME not in place and ITEM not in place
    ]
    return list(dict.fromkeys(named))


def _without_methods(place: Sequence[Any]) -> list[Any]:
    """Return a place without families and methods, which choose the forms of tables."""
    return [part for part in place if part not in (*METHODS, *METHODS.values())]
