"""Figures of which a test gives only what it is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from slide_fmu.report.run_figures import RunFigures

Kind = TypeVar("Kind")

NEUTRAL = {str: "", int: 0, float: 0.0, bool: False}


def filled(kind: type[Kind], **known: Any) -> Kind:
    """Return figures of a kind: what is known, and neutral values of all else."""
    found: Kind = _filled(kind, known)
    return found


def run_figures(**known: Any) -> RunFigures:
    """Return the figures of a run, of which these are known."""
    return filled(RunFigures, **known)


def _filled(kind: Any, value: Any) -> Any:
    if get_origin(kind) in (Union, UnionType):
        kinds = [each for each in get_args(kind) if each is not NoneType]
        if value is None and len(kinds) < len(get_args(kind)):
            return None
        return _filled(kinds[0], value)
    if is_dataclass(value):
        return value
    if is_dataclass(kind):
        hints, given = get_type_hints(kind), {}
        for field in fields(kind):
            if field.name in (value or {}):
                given[field.name] = _filled(hints[field.name], value[field.name])
            elif field.default is MISSING:
                given[field.name] = _filled(hints[field.name], None)
        return kind(**given)  # type: ignore[operator]
    if get_origin(kind) is tuple:
        return _tuple(get_args(kind), value or ())
    if get_origin(kind) is Mapping or kind is dict:
        return {key: _filled(get_args(kind)[1], each) for key, each in (value or {}).items()}
    return NEUTRAL.get(kind) if value is None else value


def _tuple(kinds: tuple[Any, ...], values: Any) -> tuple[Any, ...]:
    if kinds[-1] is ...:
        return tuple(_filled(kinds[0], value) for value in values)
    return tuple(values) or tuple(_filled(kind, None) for kind in kinds)
