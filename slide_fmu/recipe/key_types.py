"""This module writes types and defaults of a recipe's keys for users who write TOML."""

from __future__ import annotations

import json
import types
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from slide_fmu.core.toml_table import Table

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
    found = []
    for item in metadata:
        inner = item.metadata if isinstance(item, FieldInfo) else [item]
        for limit in inner:
            for kind, attribute, word in LIMITS:
                if isinstance(limit, kind):
                    found.append(f"{word} {getattr(limit, attribute):.10g}")
    return f" {' '.join(dict.fromkeys(found))}" if found else ""
