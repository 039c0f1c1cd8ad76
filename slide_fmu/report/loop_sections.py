"""This module makes the section of a report on errors round loops."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import LoopFigures

LOOPS = (
    "Where the output decides the input, an error goes round the loop. The surrogate's slopes and "
    "the partner say how many times as large the error of the output becomes by that, at the "
    "frequency where it grows most: the median over places of the measured motions, for the "
    "smallest, middle and largest values of the partner together."
)


def loop_sections(loops: Sequence[LoopFigures]) -> list[ReportSection]:
    """Return the section on errors round loops, where the recipe has some."""
    if not loops:
        return []
    worst = max(loops, key=lambda one: one.gain)
    heading = "output", "input", "partner", "an error of the output becomes", "at a frequency of"
    rows = ((o.output, o.input, o.partner, _becomes(o), f"{o.hz:.2g} Hz") for o in loops)
    text = " ".join([LOOPS, *loop_sentences([worst])])
    return [ReportSection("Errors round the loop", text, ReportTable.of(heading, rows))]


def loop_sentences(loops: Sequence[LoopFigures]) -> list[str]:
    """Say what becomes of an error of the output in loops, a sentence for each partner."""
    return [
        f"In a loop with {one.partner} at {one.input}, an error of {one.output} becomes about "
        f"{_becomes(one)} at {one.hz:.2g} Hz, where it grows most."
        for one in loops
    ]


def _becomes(loop: LoopFigures) -> str:
    return f"{loop.gain:.2g} times as large"
