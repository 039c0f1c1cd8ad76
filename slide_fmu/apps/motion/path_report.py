"""The report of a corrected path shows its errors before and after, and the corrections."""

from __future__ import annotations

import numpy as np

from slide_fmu.apps.motion.motion_report import coordinate_panels, limit_table
from slide_fmu.apps.motion.path_correction import CorrectedFigures, PathErrors, PathSolution
from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.web.charts import Chart, Line, Panel
from slide_fmu.report.html_report import Fact, Report, ReportSection, Verdict
from slide_fmu.report.table import ReportTable


def path_report(corrected: PathSolution) -> Report:
    """Return the report of a corrected path."""
    figures = corrected.figures()
    errors, unit = figures.predicted, figures.unit
    summary = (
        f"The path is off by {quantity(errors.rms_before, unit)} RMS as it is, and by "
        f"{quantity(errors.rms_after, unit)} with its corrections, as the surrogate predicts. "
        f"{_margin_words(figures)}"
    )
    text = (
        "Errors are distances of the outputs from where they are wished to be. For the tool of a "
        "serial chain that is where rigid links would have it."
    )
    sections = [
        ReportSection("Errors", text, path_table(corrected), charts=[_errors(corrected)]),
        ReportSection(
            "Corrections",
            "What the corrections add to each coordinate. Where the coordinates hardly move the "
            "outputs in some direction, the condition number is large, and errors in that "
            "direction stay: the largest one along this path is "
            f"{decimal(figures.largest_condition)}.",
            limit_table(figures.limits_used),
            charts=[_corrections(corrected)],
        ),
    ]
    title = f"Corrected path with {corrected.surrogate.name}"
    return Report(title, summary, figures, sections, verdict=Verdict(facts=_facts(corrected)))


def _margin_words(figures: CorrectedFigures) -> str:
    """Say how far the prediction may be off."""
    if figures.largest_margin == 0.0:
        return f"How far it may be off in that is not known: the margin is {figures.margin_is}."
    margin = quantity(figures.largest_margin, figures.unit)
    return f"It may be off by {margin} in that: {figures.margin_is}."


def remark_on_path(corrected: PathSolution) -> str | None:
    """Say which part of the corrected path the surrogate does not know; None if it knows all."""
    known = corrected.figures().known
    if known == 1.0:
        return None
    return (
        f"{percent(1.0 - known)} of the path is outside of the domain of the surrogate, where its "
        "margin says nothing: choose a slower path, or rely on --verify alone."
    )


def _facts(corrected: PathSolution) -> list[Fact]:
    """Return the large numbers: the error before and after, by surrogate and reference."""
    figures = corrected.figures()
    unit, errors = figures.unit, figures.predicted
    margin = "As the surrogate predicts."
    if figures.largest_margin > 0.0:
        margin = f"As the surrogate predicts, to within {quantity(figures.largest_margin, unit)}."
    facts = [
        Fact("Before", quantity(errors.rms_before, unit), "RMS error of the path as it is."),
        Fact("After", quantity(errors.rms_after, unit), margin),
    ]
    if figures.reference is not None:
        after = quantity(figures.reference.rms_after, unit)
        facts.append(Fact("Reference model", after, "RMS error after the correction."))
    limit = max(figures.limits_used.items(), key=lambda item: item[1], default=None)
    if limit is not None:
        text = f"The largest part of a limit that is used, of {limit[0]}."
        facts.append(Fact("Limits", percent(limit[1]), text, limit[1] <= 1 + 1e-6))
    return facts


def path_table(corrected: PathSolution) -> ReportTable:
    """Return the errors before and after."""
    figures = corrected.figures()
    sources = ("surrogate", figures.predicted), ("reference model", figures.reference)
    rows = ((n, *_cells(e, figures.unit)) for n, e in sources if e is not None)
    heading = "by", "RMS before", "RMS after", "largest before", "largest after", "less"
    return ReportTable.of(heading, rows, "errors")


def _cells(errors: PathErrors, unit: str) -> list[str]:
    distances = (
        errors.rms_before,
        errors.rms_after,
        errors.largest_before,
        errors.largest_after,
    )
    less = errors.times_less
    return [
        *(quantity(distance, unit) for distance in distances),
        "all of it" if less is None else f"{decimal(less)} times",
    ]


def _errors(corrected: PathSolution) -> Chart:
    """Draw the distance from the wished outputs over time, before and after."""
    time, compensated = _time(corrected), corrected.compensated
    courses = [
        ("before, predicted", compensated.before, "truth", False),
        ("after, predicted", compensated.after, "line", False),
        ("before, reference model", corrected.true_before, "truth", True),
        ("after, reference model", corrected.true_after, "line", True),
    ]
    lines = [
        Line(name, time, _distance(error), colour, dashed=dashed)
        for name, error, colour, dashed in courses
        if error is not None
    ]
    lines.append(Line("margin of the prediction", time, corrected.margin, "cursor", width=1.0))
    panel = Panel("error", corrected.surrogate.outputs[0].unit, lines, log=True)
    return Chart("Errors before and after", [panel])


def _distance(error: FloatArray) -> FloatArray:
    distance = np.linalg.norm(error, axis=1)
    return np.asarray(
        np.where(distance > 0, distance, np.nan)
    )  # the logarithm of zero does not exist


def _corrections(corrected: PathSolution) -> Chart:
    time, compensated = _time(corrected), corrected.compensated
    changes = compensated.motion - compensated.path
    return Chart(
        "Corrections",
        coordinate_panels("correction", compensated.predictor.coordinates, time, changes),
    )


def _time(corrected: PathSolution) -> FloatArray:
    return np.asarray(corrected.surrogate.window.step * np.arange(len(corrected.compensated.path)))
