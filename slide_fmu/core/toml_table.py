"""Tables that people write in TOML: what is not meant so is refused, and nothing is converted."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


class Table(BaseModel):
    """A Table refuses unknown keys and values of another type; its values do not change.

    ``true`` is no number here and ``"3"`` neither; a whole number counts as a number. Lists may
    stand where the fields are tuples.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    @model_validator(mode="before")
    @classmethod
    def _lists_are_tuples(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        return {key: _without_lists(value) for key, value in values.items()}


def _without_lists(value: Any) -> Any:
    """Return a value with tuples in the place of lists; tables inside see to their own."""
    return tuple(map(_without_lists, value)) if isinstance(value, list) else value
