"""This module makes the sections of a report that show rows."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.core.signals import Hold
from slide_fmu.core.web.charts import HeatMap
from slide_fmu.report.html_report import ReportSection, folded
from slide_fmu.report.row_tables import (
    HELD,
    RULE,
    WORDS,
    failures,
    kind_table,
    output_table,
    row_table,
)
from slide_fmu.report.step_chart import MODEL_TEXT, TITLE, has_model, step_charts
from slide_fmu.validation.row import Row


def main_sections(rows: Sequence[Row], hold: Hold, maps: Sequence[HeatMap]) -> list[ReportSection]:
    """Return the picture of the error against the communication step, and the table of kinds.

    Args:
        rows: all that was measured.
        hold: how the inputs of the FMU act between samples.
        maps: the error by amplitude and frequency of the inputs.
    """
    if not rows:
        return []
    charts = step_charts(rows)
    found = (
        [ReportSection(TITLE, MODEL_TEXT if has_model(rows) else "", charts=charts)]
        if charts
        else []
    )
    judged = f" {RULE}" if any(row.valid is not None for row in rows) else ""
    held = f"{HELD} " if hold == "zero_order" else ""
    table = kind_table(rows, short=False)
    text = f"{table.title[0].upper()}{table.title[1:]}. {held}{WORDS}{judged}"
    return [*found, ReportSection("Where it is valid", text, table, maps=maps)]


def all_rows(rows: Sequence[Row]) -> list[ReportSection]:
    """Return the folded sections with all rows, and with the errors of each output in its unit."""
    if not rows:
        return []
    text = " ".join([WORDS, "The width is the mean bound over the usual level.", *failures(rows)])
    return folded(
        [
            ReportSection("All that was measured", text, row_table(rows)),
            ReportSection(
                "Errors of each output", "In the units of the outputs.", output_table(rows)
            ),
        ]
    )
