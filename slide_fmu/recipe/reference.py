"""This module lists every key of a recipe with type, default and meaning from the typed tables.

Meanings come from the section ``Attributes`` in the docstring of each table. The site's page about
recipes and the suggestions for misspelt keys are made from this list.
"""

from __future__ import annotations

import inspect
import json
import re
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from slide_fmu.core.toml_table import Table
from slide_fmu.recipe.automatic import AUTOMATIC

WORDS: dict[Any, str] = {
    bool: "true or false",
    int: "whole number",
    float: "number",
    str: "text",
}
LIMITS = ((Gt, "gt", "above"), (Ge, "ge", "from"), (Lt, "lt", "below"), (Le, "le", "to"))


def type_text(field: FieldInfo) -> str:
    """Write the type of the values of a key, and their limits."""
    return _text(field.annotation, field.metadata)


def default_text(field: FieldInfo) -> str:
    """Write the default of a key: a value in TOML, or that it has none, or is required."""
    if field.is_required():
        return "must be given"
    value = field.get_default(call_default_factory=True)
    if value is None or value is PydanticUndefined or isinstance(value, Table):
        return ""
    if isinstance(value, tuple | list | Mapping) and not value:
        return ""
    return json.dumps(value, ensure_ascii=False)


def _text(annotation: Any, metadata: list[Any]) -> str:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _text(arguments[0], [*arguments[1:], *metadata])
    if annotation in WORDS:
        return WORDS[annotation] + _limits(metadata)
    if origin is Literal:
        return " or ".join(json.dumps(choice) for choice in arguments)
    if origin in (Union, types.UnionType):
        several = [each for each in arguments if each is not type(None)]
        if float in several:  # a whole number counts as one
            several = [each for each in several if each is not int]
        texts = [_text(each, metadata) for each in several]
        return ", or ".join(dict.fromkeys(texts))
    if origin is tuple:
        return _list_text(arguments)
    if origin is dict:
        return f"table: {_text(arguments[1], [])} for each name"
    return "table"


def _list_text(arguments: tuple[Any, ...]) -> str:
    item = _text(arguments[0], [])
    if arguments[-1] is Ellipsis:
        return f"list: {item} each"
    return f"list of {len(arguments)}: {item} each"


def _limits(metadata: list[Any]) -> str:
    """Write the limits of a number; the limits of a whole ``Field`` are in its own metadata."""
    texts = []
    for item in metadata:
        inner = item.metadata if isinstance(item, FieldInfo) else [item]
        for limit in inner:
            for kind, attribute, word in LIMITS:
                if isinstance(limit, kind):
                    texts.append(f"{word} {getattr(limit, attribute):.10g}")
    return f" {' '.join(dict.fromkeys(texts))}" if texts else ""


FILLED = ("data",)
"""Tables that may be missing in a file, since all their required keys can be found."""

NAME, ITEM = "NAME", "*"
"""Parts of places: a name that the user chooses, and an item of a list."""

ENTRY = re.compile(r"^(\w+(?:, \w+)*): (.*)$")
"""Begins the entry of one or several attributes."""


@dataclass(frozen=True)
class Key:
    """A Key is one key of a table, for people; ``meaning`` may be empty."""

    name: str
    type: str
    default: str
    meaning: str


@dataclass(frozen=True)
class Section:
    """A Section is one table of a file.

    Attributes:
        place: its keys from the file's begin, as ``("system", "inputs", NAME)``; the name of the
            choice stands behind a table of several forms, as ``("network", "state_space")``.
        tag: key and value that choose among several forms, as ``("family", "state_space")``; None
            where there is one form alone.
        table: the class of the table.
        keys: its keys, in their order.
    """

    place: tuple[str, ...]
    tag: tuple[str, str] | None
    table: type[Table]
    keys: tuple[Key, ...]

    def matches(self, place: tuple[str | int, ...]) -> bool:
        """Tell whether the table at a place, as pydantic names it, is of this section."""
        return len(place) == len(self.place) and all(
            mine in (NAME, ITEM) or mine == str(given)
            for mine, given in zip(self.place, place, strict=True)
        )


def sections_of(table: type[Table], place: tuple[str, ...] = ()) -> Iterator[Section]:
    """Yield the sections of a file whose outermost table is given, that one first."""
    tag = _tag(table) if place and place[-1] == (_tag(table) or ("", ""))[1] else None
    yield Section(place, tag, table, _keys(table, place))
    for name, field in table.model_fields.items():
        tables = list(_tables_in(field.annotation))
        for inner, kind in tables:
            of_several = sum(1 for where, _ in tables if where == inner) > 1
            form = (_tag(kind) or ("", ""))[1:] if of_several else ()
            yield from sections_of(kind, (*place, name, *inner, *form))


def known_keys(table: type[Table], place: tuple[str | int, ...]) -> list[str]:
    """Return the keys of the table at a place of a file; empty if the table does not exist."""
    return [
        key.name
        for section in sections_of(table)
        if section.matches(place)
        for key in section.keys
    ]


def about(table: type[Table]) -> str:
    """Return the part of a table's docstring about the whole table."""
    return _plain((inspect.getdoc(table) or "").split("\n\nAttributes:")[0])


def _tables_in(annotation: Any) -> Iterator[tuple[tuple[str, ...], type[Table]]]:
    """Yield the tables in a type, each with the parts of its place behind the key."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield (), annotation
    arguments, origin = get_args(annotation), get_origin(annotation)
    if origin is Annotated:
        yield from _tables_in(arguments[0])
    elif origin in (Union, types.UnionType):
        for argument in arguments:
            yield from _tables_in(argument)
    elif origin in (dict, tuple):
        part = NAME if origin is dict else ITEM
        for inner, table in _tables_in(arguments[-1 if origin is dict else 0]):
            yield (part, *inner), table


def _tag(table: type[Table]) -> tuple[str, str] | None:
    """Return the key of a table that can have one value alone, and that value."""
    for name, field in table.model_fields.items():
        if get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1:
            return name, str(get_args(field.annotation)[0])
    return None


@cache  # every mistake in a recipe asks for the keys of its table
def _keys(table: type[Table], place: tuple[str, ...]) -> tuple[Key, ...]:
    meanings = _meanings(table)
    return tuple(
        _key(name, field, ".".join((*place, name)) in AUTOMATIC, meanings.get(name, ""))
        for name, field in table.model_fields.items()
        if field.repr  # without it, a field is filled in by the program
    )


def _key(name: str, field: FieldInfo, automatic: bool, meaning: str) -> Key:
    meaning = meaning[:1].upper() + meaning[1:]
    if automatic:
        return Key(name, f'{type_text(field)}, or "auto"', '"auto"', meaning)
    return Key(name, type_text(field), "" if name in FILLED else default_text(field), meaning)


def _meanings(table: type[Table]) -> dict[str, str]:
    """Return the meanings of attributes by name, with the interfaces of a table."""
    meanings: dict[str, str] = {}
    for kind in reversed(table.__mro__):
        documentation = inspect.cleandoc(kind.__dict__.get("__doc__") or "")
        _, _, block = documentation.partition("\n\nAttributes:\n")
        names: tuple[str, ...] = ()
        for line in block.splitlines():
            entry = ENTRY.match(line.removeprefix("    "))
            if line and not line.startswith(" "):
                break  # another section
            if entry:
                names = tuple(entry[1].split(", "))
                meanings.update(dict.fromkeys(names, entry[2]))
            elif line.strip():
                meanings.update({name: f"{meanings[name]} {line.strip()}" for name in names})
    return {name: _plain(text) for name, text in meanings.items()}


def _plain(text: str) -> str:
    """Return the text of a docstring on one line, in the words of Markdown."""
    return " ".join(text.split()).replace("``", "`")
