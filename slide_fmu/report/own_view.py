"""What an FMU says of its own outputs under a file of inputs, in sentences and a table."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.report.row_tables import CALLS, STEP_DIGITS
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.own_view import OwnView

MOST_PARTS = 12
"""Number of parts of a file that are shown; JSON has all of them."""


def view_sentences(view: OwnView) -> list[str]:
    """Say how much an FMU does not trust, and why."""
    step = quantity(view.step_s, "s", STEP_DIGITS)
    lines = [f"{view.samples} samples, {step} apart, {CALLS[view.call].within}."]
    lines += [f"Input {text}." for text in view.out_of_range]
    if view.not_trusted is None:
        reason = (
            "error_bound_filled never becomes 1: the file is too short, or the step too long"
            if view.bounded
            else "it has no error bound"
        )
        return [*lines, f"The FMU does not say what it trusts: {reason}."]
    assert view.first_s is not None
    lines.append(
        f"The FMU does not trust {percent(view.not_trusted)} of the samples from "
        f"{decimal(view.first_s, 6)} s on; before, its bound has not seen the inputs it needs."
    )
    lines += [f"In {percent(one.share)}, {one.why}." for one in view.reasons]
    return lines


def parts_table(view: OwnView) -> ReportTable | None:
    """Return where an FMU does not trust its outputs: the largest parts, in the order of time."""
    if not view.parts:
        return None
    largest = sorted(view.parts, key=lambda part: -part.samples)[:MOST_PARTS]
    shown = sorted(largest, key=lambda part: part.begin_s)
    left = len(view.parts) - len(shown)
    rows = (
        (
            f"{decimal(part.begin_s, 6)} s",
            f"{decimal(part.end_s, 6)} s",
            percent(part.share),
            "; ".join(part.why),
        )
        for part in shown
    )
    title = "Where it does not trust them" + (f", without {left} smaller parts" if left else "")
    return ReportTable.of(("from", "to", "not trusted", "why"), rows, title)
