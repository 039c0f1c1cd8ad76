"""Errors that pydantic finds in a table written by a user are put into the user's words.

A message has the key, the value found and the value expected. It uses the words of TOML and
Python, where pydantic uses its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from slide_fmu.core.shown import shown
from slide_fmu.core.suggestions import or_meant

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
"""Expectations, by pydantic's type of error."""

WITHIN = "within"
"""Key under which the context of an error has the place of its cause within the value."""

LIMITS = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
"""Expectations for numbers beyond a limit, with the key under which pydantic gives the limit."""

FORMS = {
    r"^[A-Za-z][A-Za-z0-9_]{0,99}$": "a letter first, then letters, digits and _, at most 100",
    r"^[\w.]+:\w+$": "'module:function'",
}
"""Descriptions of text patterns, by pattern."""


def value_text(value: Any) -> str:
    """Write a value as in TOML: lists in brackets, true and false in lower case."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(value_text, value))}]"
    return shown(value)


def expectation(item: Any) -> str:
    """Return the value that was expected, as words, for one error of pydantic."""
    kind, context = item["type"], item.get("ctx", {})
    if kind == "too_long":
        return f"expected {context['max_length']} values, not {context['actual_length']}"
    if kind == "too_short":
        least = context["min_length"]
        return f"expected at least {least} value{'s'[: least - 1]}"
    if kind in LIMITS:
        words, limit = LIMITS[kind]
        return f"expected {words} {context[limit]:.15g}"
    if kind == "literal_error":
        choices = [choice.strip("'") for choice in _choices(context["expected"])]
        return f"expected {context['expected']}{or_meant(str(item['input']), choices)}"
    if kind == "string_pattern_mismatch":
        return f"expected {FORMS.get(context['pattern'], context['pattern'])}"
    return PLAIN.get(kind) or str(item["msg"]).removeprefix("Value error, ")


def meant_choice(given: str, expected: str) -> str:
    """Return an ending for a message about a choice, such as ``; did you mean 'tanh'?``."""
    return or_meant(given, _choices(expected))


def _choices(expected: str) -> list[str]:
    """Return the choices in pydantic's text ``'a', 'b' or 'c'``."""
    return [part.strip(" '") for part in expected.replace(" or ", ", ").split(",")]


def causes(error: ValidationError) -> list[Any]:
    """Return the errors that are causes, one for each value, as pydantic describes them."""
    return _joined([item for item in error.errors() if _is_cause(item)])


def mistakes(
    error: ValidationError, source: str, known: Mapping[str, Sequence[str]] | None = None
) -> str:
    """Describe the errors in a table, one line each, with dotted names of the keys.

    Args:
        error: the errors that pydantic found.
        source: the name of the table in messages.
        known: the known keys: of inner tables by the name of the outermost key, of the table
            itself by an empty name.
    """
    return "\n".join(f"{source}: {_sentence(item, known or {})}" for item in causes(error))


def _sentence(item: Any, known: Mapping[str, Sequence[str]]) -> str:
    parts = [str(part) for part in item["loc"] if part != "[key]"]
    place, value = ".".join(parts), value_text(item["input"])
    if item["type"] == "missing":
        return f"{place} is missing; expected a value: give it"
    if item["type"] == "extra_forbidden":
        keys = list(known.get(parts[0] if len(parts) > 1 else "", ()))
        return (
            f"{place} = {value} is not a known key; expected some of {keys}: correct or remove it"
            f"{or_meant(parts[-1], keys)}"
        )
    message = item.get("several") or expectation(item)
    remedy = "" if message.endswith("?") else ": correct it"
    return f"{place} = {value}; {message}{remedy}"


def _is_cause(item: Any) -> bool:
    """Return whether an error is a cause; a list emptied by errors of its items is not."""
    return not (item["type"] == "too_short" and item["input"])


def _joined(errors: list[Any]) -> list[Any]:
    """Join errors about one value: pydantic gives one for each type that the value may have."""
    joined: dict[tuple[Any, ...], list[Any]] = {}
    for item in errors:
        *outer, last = item["loc"] or ("",)
        of_several = last in ("float", "int", "str", "bool") and item["type"] != "extra_forbidden"
        place = tuple(outer) if of_several and outer else item["loc"]
        joined.setdefault(place, []).append(item)
    return [_one_of(place, items) for place, items in joined.items()]


def _one_of(place: tuple[Any, ...], items: list[Any]) -> Any:
    """Return one error in place of all errors about one value."""
    if len(items) == 1:
        return items[0]
    words = [expectation(item).removeprefix("expected ") for item in items]
    return {**items[0], "loc": place, "several": f"expected {', or '.join(words)}"}
