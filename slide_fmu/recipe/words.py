"""What is said of a mistake in a TOML file, in the words of TOML instead of those of Python."""

from __future__ import annotations

from typing import Any

from slide_fmu.core.suggestions import nearest, or_meant
from slide_fmu.core.toml_table import Table
from slide_fmu.recipe.reference import known_keys, sections_of

PLAIN = {
    "tuple_type": "expected a list in brackets",
    "dict_type": "expected a table of keys and values",
    "model_type": "expected a table of keys and values",
    "model_attributes_type": "expected a table of keys and values",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "float_type": "expected a number",
    "finite_number": "expected a finite number",
    "bool_type": "expected true or false",
    "string_type": "expected a text in quotes",
}
"""What is said of a value, by the kind of mistake."""

LIMITS = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
"""What is said of a number beyond a limit, and where pydantic says which one."""

FORMS = {
    r"^[A-Za-z][A-Za-z0-9_]{0,99}$": "a letter first, then letters, digits and _, at most 100",
    r"^[\w.]+:\w+$": "'module:function'",
}
"""Texts of a form, by its pattern."""


def value_text(value: Any) -> str:
    """Write a value as TOML has it, with lists in brackets and true and false in small letters."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(value_text, value))}]"
    return repr(value)


def expectation(item: Any) -> str:
    """Say what was expected instead of a value, as pydantic describes the mistake."""
    kind, context = item["type"], item.get("ctx", {})
    if kind == "too_long":
        return f"expected {context['max_length']} values, not {context['actual_length']}"
    if kind in LIMITS:
        words, limit = LIMITS[kind]
        return f"expected {words} {context[limit]:.15g}"
    if kind == "literal_error":
        choices = [choice.strip("'") for choice in _choices(context["expected"])]
        return f"expected {context['expected']}{or_meant(str(item['input']), choices)}"
    if kind == "string_pattern_mismatch":
        return f"expected {FORMS.get(context['pattern'], context['pattern'])}"
    return PLAIN.get(kind) or str(item["msg"]).removeprefix("Value error, ")


def unknown_key(place: tuple[str | int, ...], file: type[Table] | None) -> str:
    """Say that a key is not known, and which one may be meant.

    Args:
        place: the key's place in the file, its own name last.
        file: the outermost table of the file; nothing is suggested where there is none.
    """
    *table, key = place
    if file is not None and (other := _of_other_forms(tuple(table), str(key), file)):
        return other
    known = known_keys(file, tuple(table)) if file is not None else []
    elsewhere = [] if file is None else _tables_with(str(key), file)
    if elsewhere:
        return f"is not a known key; {key} is one of {' and '.join(elsewhere)}: move or remove it"
    meant = nearest(str(key), known)
    if meant is not None:
        return f"is not a known key; did you mean {meant}? Correct its spelling, or remove it"
    return "is not a known key; remove it or correct its spelling"


def meant_choice(found: str, expected: str) -> str:
    """Return what to add to a message about a choice, as ``; did you mean 'tanh'?``."""
    return or_meant(found, _choices(expected))


def _choices(expected: str) -> list[str]:
    """Return the choices in pydantic's text ``'a', 'b' or 'c'``."""
    return [part.strip(" '") for part in expected.replace(" or ", ", ").split(",")]


def _of_other_forms(table: tuple[str | int, ...], key: str, file: type[Table]) -> str | None:
    """Say that a key belongs to a table of another form, as of another family; else return None.

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
    switch = "network.family" if table[0] in ("network", "training") else name
    return (
        f"is not a known key where {name} = {table[-1]!r}, only where it is "
        f"{' or '.join(map(repr, forms))}: remove it, or choose another {switch}"
    )


def _tables_with(key: str, file: type[Table]) -> list[str]:
    """Return the names of a file's tables that have a key, without items of lists."""
    places = [s.place for s in sections_of(file) if key in [each.name for each in s.keys]]
    named = [f"[{place[0]}]" for place in places if len(place) == 1 or len(place) == 2]
    return list(dict.fromkeys(named))[:3]
