"""This module makes the sections of a report on the plain call and on constant inputs."""

from __future__ import annotations

from slide_fmu.report.error_tables import box_table, plain_call_table
from slide_fmu.report.html_report import ReportSection
from slide_fmu.validation.box import TEXT as BOX_TEXT
from slide_fmu.validation.error_figures import BoxFigures, PlainCallFigures
from slide_fmu.validation.plain_call import TEXT


def plain_call_sections(found: PlainCallFigures | None) -> list[ReportSection]:
    """Return the section on the plain call, where that was measured."""
    if found is None:
        return []
    text = TEXT.replace("`", "")  # only the model card shows marks of code
    return [ReportSection("Plain call", f"{text} {whole(found)}", plain_call_table(found))]


def whole(found: PlainCallFigures) -> str:
    """Return the sentence of the figures as one that stands alone."""
    return f"{found.sentence[0].upper()}{found.sentence[1:]}."


def box_sections(found: BoxFigures | None) -> list[ReportSection]:
    """Return the section on constant inputs, where these were measured."""
    if found is None:
        return []
    return [ReportSection("Constant inputs", box_text(found), box_table(found))]


def box_text(found: BoxFigures) -> str:
    """Say how constant inputs were measured, and where the reference failed."""
    failed = [text for group in found.groups.values() for text in group.failed]
    return BOX_TEXT + "".join(
        f" The reference could not be simulated at {text}." for text in failed
    )
