"""The report of a calibration shows the fitted parameters, and how records and surrogate agree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.apps.calibrate.calibrate_fmu import FittedCourse
from slide_fmu.apps.calibrate.result import Calibration, FittedParameter, OutputFit
from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind, labelled
from slide_fmu.core.web.charts import Chart, HeatCell, HeatMap, Line, Panel
from slide_fmu.report.html_report import Fact, Report, ReportSection, Verdict, remark_sections
from slide_fmu.report.table import ReportTable

SHOWN = 160
"""Largest number of samples around the largest deviation that a chart shows."""

FIT = (
    "Each output around its largest deviation: the record, the surrogate at the fitted values, "
    "and at the values where the search began."
)

CORRELATION = (
    "Correlation of the fitted values. Two parameters near 1 or -1 can hardly be distinguished."
)


def calibration_report(calibration: Calibration, courses: Sequence[FittedCourse]) -> Report:
    """Return the report of a calibration.

    Args:
        calibration: the result.
        courses: the records without gaps, next to the surrogate.
    """
    charts = [_chart(fit, courses) for fit in calibration.outputs]
    maps = [_correlation(calibration)] if len(calibration.parameters) > 1 else []
    sections = [
        ReportSection("Records and surrogate", FIT, output_table(calibration), charts=charts),
        ReportSection(
            "Fitted parameters", _held(calibration), parameter_table(calibration), maps=maps
        ),
        *remark_sections(calibration.remarks),
    ]
    facts = [
        *map(_parameter_fact, calibration.parameters),
        *map(_output_fact, calibration.outputs),
    ]
    title = f"Calibration of {calibration.name}"
    summary = f"Parameters were fitted to {calibration.samples} samples of measured records."
    return Report(title, summary, calibration.figures(), sections, verdict=Verdict(facts=facts))


def parameter_table(calibration: Calibration) -> ReportTable:
    """Return the fitted values with their intervals and ranges."""
    rows = (
        (
            labelled(one.parameter.name, one.parameter.unit),
            decimal(one.value, 5),
            f"{decimal(one.low, 5)} .. {decimal(one.high, 5)}",
            f"{decimal(one.parameter.low, 5)} .. {decimal(one.parameter.high, 5)}",
        )
        for one in calibration.parameters
    )
    return ReportTable.of(("parameter", "value", "95 % interval", "range"), rows)


def output_table(calibration: Calibration) -> ReportTable:
    """Return the errors of the outputs before and after."""
    rows = (
        (
            fit.name,
            *(quantity(rmse, fit.unit) for rmse in (fit.before, fit.after)),
            percent(fit.relative),
        )
        for fit in calibration.outputs
    )
    return ReportTable.of(("output", "RMSE before", "RMSE after", "relative RMSE after"), rows)


def _held(calibration: Calibration) -> str:
    return " ".join(
        f"{name} was held at {decimal(value, 6)}." for name, value in calibration.fixed.items()
    )


def _parameter_fact(one: FittedParameter) -> Fact:
    unit = behind(one.parameter.unit)
    text = f"95 % interval: {decimal(one.low, 4)} to {decimal(one.high, 4)}{unit}."
    good = None if one.remark is None else False
    return Fact(one.parameter.name, f"{decimal(one.value, 4)}{unit}", text, good)


def _output_fact(fit: OutputFit) -> Fact:
    text = f"Relative RMSE after the fit. RMSE before: {quantity(fit.before, fit.unit)}."
    return Fact(fit.name, percent(fit.relative), text)


def _chart(fit: OutputFit, courses: Sequence[FittedCourse]) -> Chart:
    """Draw an output of the record in which its largest deviation lies."""

    def deviation(course: FittedCourse) -> FloatArray:
        apart = np.abs(course.fitted[fit.name] - course.measured[fit.name])
        return np.asarray(np.where(np.isfinite(apart), apart, -1.0))

    worst = max(courses, key=lambda course: float(deviation(course).max(initial=-1.0)))
    apart = deviation(worst)
    count = min(len(apart), SHOWN)
    first = min(max(0, int(np.argmax(apart)) - count // 2), len(apart) - count)
    part = slice(first, first + count)
    time = worst.time[part]
    lines = [
        Line("record", time, worst.measured[fit.name][part], "truth", dashed=True, width=3.0),
        Line("before", time, worst.before[fit.name][part], "input-5", width=1.1),
        Line("fitted", time, worst.fitted[fit.name][part], "line", width=1.5),
    ]
    away = np.where(apart < 0, np.nan, apart)[part]
    error = Panel(
        "deviation", fit.unit, [Line("|deviation|", time, away, "bad", width=1.1)], include=(0.0,)
    )
    return Chart(fit.name, [Panel(fit.name, fit.unit, lines), error])


def _correlation(calibration: Calibration) -> HeatMap:
    names = [one.parameter.name for one in calibration.parameters]
    cells = [
        [HeatCell(f"{value:.2f}", abs(value)) for value in row] for row in calibration.correlation
    ]
    return HeatMap("Correlation", CORRELATION, "parameter", "", names, names, cells)
