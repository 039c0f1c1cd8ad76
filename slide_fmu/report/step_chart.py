"""The picture "error against communication step" stands at the top of report and card."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.core.web.charts import Axis, Chart, Line, Panel
from slide_fmu.report.row_tables import CALLS
from slide_fmu.validation.row import SMOOTH, Call, Row

TITLE = "Error against communication step"

MS = 1e3
"""Milliseconds in a second."""

TWO_LINES = (
    "The other line is the finest model itself as an FMU in the same call: it knows its inputs at "
    "communication points alone, and holds them over the step. Where both lines meet, no FMU can "
    "do better in this call."
)
"""Explanation of the second line."""


def step_charts(rows: Sequence[Row]) -> list[Chart]:
    """Draw the error of the plain call over the communication step; nothing if not measured."""
    smooth = [row for row in rows if row.group == SMOOTH]
    plain = _line(smooth, "plain", f"FMU, {CALLS['plain'].name}")
    if plain is None:
        return []
    lines = [plain, _points(plain)]
    model = _line(smooth, "model", CALLS["model"].name)
    if model is not None:
        lines += [model, _points(model)]
    known = _line(smooth, "known", f"FMU, {CALLS['known'].name}")
    if known is not None:
        lines.append(Line(known.name, known.x, known.y, "estimate", "points", width=4.0))
    own = next(row.step_s * row.steps for row in smooth)
    panel = Panel("relative RMSE", "%", lines, log=True)
    text = f"{smooth[0].inputs}; dotted: the own step h"
    return [
        Chart(TITLE, [panel], Axis("communication step", "ms", log=True), text, (), [MS * own])
    ]


def has_model(rows: Sequence[Row]) -> bool:
    """Tell whether the finest model was measured in the place of the FMU."""
    return any(row.call == "model" for row in rows)


def _line(rows: Sequence[Row], call: Call, name: str) -> Line | None:
    chosen = sorted((row for row in rows if row.call == call), key=lambda row: row.step_s)
    if not chosen:
        return None
    steps = np.array([MS * row.step_s for row in chosen])
    errors = np.array([100 * row.error for row in chosen])
    colour = "truth" if call == "model" else "line"
    return Line(name, steps, errors, colour, dashed=call == "model")


def _points(line: Line) -> Line:
    return Line("", line.x, line.y, line.colour, "points", width=3.0)
