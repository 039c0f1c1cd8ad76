"""Figures are frozen dataclasses; JSON files hold their dump, from which they are read again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, is_dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

if TYPE_CHECKING:  # slow to import, and the console writes figures that it does not read
    from pydantic import TypeAdapter

Kind = TypeVar("Kind")

JsonObject = dict[str, Any]
"""A JSON object in Python whose keys are not known yet."""

LEFT_OUT, SPREAD = "left out", "spread"
"""Marks of fields. ``LEFT_OUT``: a dump leaves the field out where it has its default. ``SPREAD``:
the items of this mapping become keys of the dump itself."""


@runtime_checkable
class FigureTable(Protocol):
    """A FigureTable was read from TOML, by a model of pydantic."""

    def model_dump(self) -> dict[str, object]:
        """Return its values by their keys."""


def optional(default: Any = None) -> Any:
    """Make a field that a dump leaves out where it has its default."""
    return field(default=default, metadata={LEFT_OUT: True})


def spread() -> Any:
    """Make a field of a mapping whose items become keys of the dump itself."""
    return field(metadata={SPREAD: True})


def plain(figures: object) -> Any:
    """Return figures as plain values: dictionaries, lists, numbers, texts and None."""
    if is_dataclass(figures) and not isinstance(figures, type):
        values: dict[str, object] = {}
        for one in fields(figures):
            value = getattr(figures, one.name)
            if one.metadata.get(LEFT_OUT) and value == one.default:
                continue
            values |= plain(value) if one.metadata.get(SPREAD) else {one.name: plain(value)}
        return values
    if isinstance(figures, Mapping):
        return {key: plain(value) for key, value in figures.items()}
    if isinstance(figures, tuple | list):
        return [plain(value) for value in figures]
    if isinstance(figures, FigureTable):
        return plain(figures.model_dump())
    return figures


def read_figures(kind: type[Kind], values: object) -> Kind:
    """Return the figures that have this dump; keys that the kind does not know are ignored.

    Raises:
        ValueError: a key is missing, or a value has another type than the kind says.
    """
    adapter: TypeAdapter[Kind] = _adapter(kind)  # type: ignore[arg-type]
    return adapter.validate_python(values)


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)
