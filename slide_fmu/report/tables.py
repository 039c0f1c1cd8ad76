"""Tables of what a training searched for, as rows of text, for the report and the console."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def size_rows(sizes: Sequence[Mapping[str, Any]]) -> list[Sequence[str]]:
    """Return a table of the sizes that a search has tried, its heading first."""
    rows: list[Sequence[str]] = [
        ("order", "units", "parameters", "validation error", "of which learnable")
    ]
    for size in sizes:
        errors = [
            "" if size[key] is None else f"{size[key]:.3g}"
            for key in ("validation_error", "learnable_error")
        ]
        rows.append((str(size["order"]), str(size["units"]), str(size["parameters"]), *errors))
    return rows


def curve_rows(curve: Mapping[str, Any]) -> list[Sequence[str]]:
    """Return a table of a learning curve, its heading first."""
    rows: list[Sequence[str]] = [
        ("trajectories", "validation error", "training error", "time / s")
    ]
    rows += [
        (
            str(p["trajectories"]),
            f"{p['validation_error']:.3g}",
            f"{p['training_error']:.3g}",
            f"{p['seconds']:.0f}",
        )
        for p in curve["points"]
    ]
    return rows


WORST = 5
"""So many of the values of physical parameters with the largest errors are shown."""


def parameter_rows(found: Mapping[str, Any]) -> list[Sequence[str]]:
    """Return a table of the errors by physical parameters, its heading first.

    Of the other values the worst ``WORST`` are shown; all corners are.
    """
    names: list[str] = found["names"]
    unseen = sorted(found["unseen"], key=_error_of, reverse=True)[:WORST]
    corners = sorted(found["corners"], key=_error_of, reverse=True)
    return [
        ("values", *names, "relative RMSE"),
        *(_parameter_row("corner", row, names) for row in corners),
        *(_parameter_row("measured, worst", row, names) for row in unseen),
    ]


def about_parameters(is_record: bool) -> str:
    """Say at which values of the physical parameters the errors in their table were measured."""
    where = (
        "Every stretch has the values of its specimen."
        if is_record
        else "Every trajectory has values of the physical parameters that no training saw; one "
        "more is at each corner of their ranges, which the figures above do not count."
    )
    return f"{where} Relative RMSE is the largest of the outputs."


def _error_of(row: Mapping[str, Any]) -> float:
    return float(max(row["relative_rmse"]))


def _parameter_row(what: str, row: Mapping[str, Any], names: list[str]) -> Sequence[str]:
    values = (f"{row[name]:.4g}" for name in names)
    return what, *values, f"{100 * _error_of(row):.3g} %"


def scientific(value: float) -> str:
    """Return a small number with three digits."""
    return f"{value:.2e}"
