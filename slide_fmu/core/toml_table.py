"""Tables written in TOML are read strictly: wrong types are refused, nothing is converted."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


class Table(BaseModel):
    """A Table refuses unknown keys and values of another type; it cannot be changed.

    ``true`` and ``"3"`` are not numbers here; a whole number counts as a number. A list is
    accepted for a field that is a tuple.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    @model_validator(mode="before")
    @classmethod
    def _lists_are_tuples(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        return {key: _without_lists(value) for key, value in values.items()}


def _without_lists(value: Any) -> Any:
    """Return a value with tuples in place of lists; tables inside it convert their own lists."""
    return tuple(map(_without_lists, value)) if isinstance(value, list) else value
