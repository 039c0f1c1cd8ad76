"""Recipes of measured records have parts and shares of samples in place of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args

KIND = "record"
"""The kind of system whose trajectories are measured."""

Part = Literal["train", "validation", "estimator", "estimator_validation", "test"]
"""What a part of records is used for."""

PARTS: tuple[Part, ...] = get_args(Part)
"""The parts of records in the order of time; the last one is what the FMU is measured on."""

SHARES: dict[Part, float] = {"train": 0.7, "validation": 0.15, "test": 0.15}
"""Parts of all samples where a recipe says nothing and has no error estimator."""

SHARES_WITH_ESTIMATOR: dict[Part, float] = {
    "train": 0.55,
    "validation": 0.12,
    "estimator": 0.15,
    "estimator_validation": 0.06,
    "test": 0.12,
}
"""Those where it has one, which learns from samples that the surrogate has not learnt from."""


def is_measured(tables: Mapping[str, Any]) -> bool:
    """Tell whether the tables of a recipe, which are not checked yet, are about records."""
    system = tables.get("system")
    return isinstance(system, Mapping) and system.get("kind") == KIND


def require_no_numbers(tables: Mapping[str, Any]) -> None:
    """Refuse numbers of trajectories where the samples of records decide about them.

    Raises:
        ValueError: the tables, as they were read, have one.
    """
    data = tables.get("data")
    given = [key for key in PARTS[:-1] if isinstance(data, Mapping) and key in data]
    if given:
        raise ValueError(
            f"data.{given[0]} = {data[given[0]]!r} with system.kind = {KIND!r}; expected none: "  # type: ignore[index]
            "the samples of the records decide; give data.shares, or remove it"
        )
