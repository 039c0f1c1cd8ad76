"""Charts are plain values that a page draws (``modules/chart.js``); users can zoom in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

Style = Literal["line", "steps", "points"]
Height = Literal["tall", "short", "square"]

Colour = str
"""The name of a colour in ``modules/colours.css``."""

SERIES = ("line", "truth", "input-0", "input-1", "input-2", "input-3", "input-4", "input-5")
"""Colours of lines without a special meaning, in order."""

X_DIGITS, Y_DIGITS = 7, 5
"""Digits of drawn values; x has more digits, since steps are short."""


def colour_of(index: int) -> Colour:
    """Return the colour of the line with an index; colours repeat after the last."""
    return SERIES[index % len(SERIES)]


@dataclass(frozen=True, eq=False)
class Line:
    """A Line joins points, or shows the points only.

    Attributes:
        name: its name in the legend; lines without a name are not listed.
        x, y: shape (N,); NaN makes a gap.
        style: "line", "steps" (a value holds since the point before) or "points".
        width: in pixels; for points, their radius.
    """

    name: str
    x: Values
    y: Values
    colour: Colour = "line"
    style: Style = "line"
    dashed: bool = False
    width: float = 1.6


@dataclass(frozen=True, eq=False)
class Band:
    """A Band is the area between two curves of shape (N,), as x."""

    name: str
    x: Values
    low: Values
    high: Values
    colour: Colour = "band"


@dataclass(frozen=True, eq=False)
class Panel:
    """A Panel is one plot of a chart.

    Attributes:
        title: what is drawn.
        unit: of y; "1" for plain numbers.
        lines: the first line is drawn below the others.
        log: whether y has a logarithmic axis.
        include: values that the axis always contains.
        height: "tall", "short" or "square".
    """

    title: str
    unit: str
    lines: Sequence[Line]
    bands: Sequence[Band] = ()
    log: bool = False
    include: Sequence[float] = ()
    height: Height = "tall"


@dataclass(frozen=True)
class Axis:
    """An Axis is the x axis that the panels of a chart share."""

    label: str
    unit: str = ""
    log: bool = False


TIME = Axis("time", "s")


@dataclass(frozen=True, eq=False)
class Chart:
    """A Chart is one or more panels above each other.

    Attributes:
        title: heading.
        panels: from top to bottom; they zoom together.
        axis: the x axis.
        text: explanation below the heading.
        parts: pairs of x values between which all panels are shaded.
        marks: x values at which all panels have a dotted line.
        shaded: what the shaded parts are, for the legend.
    """

    title: str
    panels: Sequence[Panel]
    axis: Axis = TIME
    text: str = ""
    parts: Sequence[tuple[float, float]] = ()
    marks: Sequence[float] = ()
    shaded: str = ""


@dataclass(frozen=True)
class Bar:
    """A Bar is one row of a bar chart: its name, its length, and the text behind it."""

    name: str
    size: float
    text: str


@dataclass(frozen=True)
class HeatCell:
    """A HeatCell is a value of a heat map: its text, its colour from 0 to 1, and a note on it."""

    text: str
    level: float
    note: str = ""


@dataclass(frozen=True)
class HeatMap:
    """A HeatMap is a table of coloured values, which a page shows without a script.

    Attributes:
        title: heading.
        text: explanation below the heading.
        across, down: what the columns and the rows are, with their units.
        columns, rows: their names.
        cells: a row for each of ``rows``, with a cell for each of ``columns``; None without value.
    """

    title: str
    text: str
    across: str
    down: str
    columns: Sequence[str]
    rows: Sequence[str]
    cells: Sequence[Sequence[HeatCell | None]]


@dataclass
class Columns:
    """Columns hold all numbers of the charts of a page; equal columns are stored once."""

    values: list[list[float | None]] = field(default_factory=list)
    _places: dict[bytes, int] = field(default_factory=dict)

    def place(self, values: Values, digits: int = Y_DIGITS) -> int:
        """Store a column, (N,), and return its number."""
        column = np.asarray(values, dtype=np.float64)
        key = digits.to_bytes(1, "big") + column.tobytes()
        if key not in self._places:
            self._places[key] = len(self.values)
            self.values.append([_rounded(value, digits) for value in column.tolist()])
        return self._places[key]


def _rounded(value: float, digits: int) -> float | None:
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def plain_chart(part: object, columns: Columns) -> Any:
    """Return a chart, or a part of one, as plain values that a page draws.

    Its arrays are stored in ``columns``, and their numbers stand in their places.
    """
    if isinstance(part, np.ndarray):
        return columns.place(part)
    if is_dataclass(part):
        return {one.name: _field(part, one.name, columns) for one in fields(part)}
    return [plain_chart(one, columns) for one in part] if isinstance(part, tuple | list) else part


def _field(part: object, name: str, columns: Columns) -> Any:
    """Return a field of a part as ``plain_chart`` does; places on the x axis have more digits."""
    value = getattr(part, name)
    return columns.place(value, X_DIGITS) if name == "x" else plain_chart(value, columns)
