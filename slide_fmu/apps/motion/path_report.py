"""The report of a corrected path shows its errors before and after, and the corrections."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slide_fmu.apps.motion.motion_report import Rows, limit_rows
from slide_fmu.apps.motion.path_correction import Corrected
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind, labelled
from slide_fmu.report.pictures import png
from slide_fmu.report.report import Report, Section


def path_report(corrected: Corrected) -> Report:
    """Return the report of a corrected path."""
    figures = corrected.figures()
    found, unit = figures["predicted"], figures["unit"]
    summary = (
        f"The path is off by {found['rms_before']:.3g}{behind(unit)} RMS as it is, and by "
        f"{found['rms_after']:.3g}{behind(unit)} with its corrections, as the surrogate "
        "predicts. It may "
        f"be off by {figures['largest_margin']:.3g}{behind(unit)} in that: {figures['margin_is']}."
    )
    text = (
        "Errors are distances of the outputs from where they are wished to be. For the tool of a "
        "serial chain that is where rigid links would have it."
    )
    sections = [
        Section("Errors", text, path_rows(corrected), [_errors(corrected)]),
        Section(
            "Corrections",
            "What the corrections add to each coordinate. Where the coordinates hardly move the "
            "outputs in some direction, the condition number is large, and errors in that "
            "direction stay: the largest one along this path is "
            f"{figures['largest_condition']:.3g}.",
            limit_rows(figures),
            [_corrections(corrected)],
        ),
    ]
    return Report(f"Corrected path with {corrected.surrogate.name}", summary, figures, sections)


def path_rows(corrected: Corrected) -> Rows:
    """Return a table of the errors before and after, its headings first."""
    figures, unit = corrected.figures(), corrected.surrogate.outputs[0].unit
    rows: Rows = [("by", "RMS before", "RMS after", "largest before", "largest after", "less")]
    for name, key in (("surrogate", "predicted"), ("reference model", "reference")):
        if key in figures:
            rows.append((name, *_cells(figures[key], unit)))
    return rows


def _cells(found: dict[str, Any], unit: str) -> list[str]:
    names = "rms_before", "rms_after", "largest_before", "largest_after"
    less = found["times_less"]
    return [
        *(f"{found[name]:.3g}{behind(unit)}" for name in names),
        "all of it" if less is None else f"{less:.3g} times",
    ]


def _errors(corrected: Corrected) -> bytes:
    """Draw the distance from where the outputs should be over time, before and after."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    ax, found = figure.subplots(), corrected.found
    rows = [("before", found.before, "C1"), ("after", found.after, "C0")]
    for name, error, colour in rows:
        ax.semilogy(_time(corrected), _distance(error), colour, label=f"{name}, predicted")
    ax.semilogy(_time(corrected), corrected.margin, "C0:", label="margin of the prediction")
    true = ("before", corrected.true_before, "C1"), ("after", corrected.true_after, "C0")
    for name, truth, colour in true:
        if truth is not None:
            label = f"{name}, reference model"
            ax.semilogy(_time(corrected), _distance(truth), f"{colour}--", label=label)
    ax.set(
        xlabel="time in s", ylabel=labelled("error", corrected.surrogate.outputs[0].unit, " in ")
    )
    ax.legend(fontsize="small")
    return png(figure)


def _distance(error: FloatArray) -> FloatArray:
    distance = np.linalg.norm(error, axis=1)
    return np.asarray(np.where(distance > 0, distance, np.nan))  # zero has no logarithm


def _corrections(corrected: Corrected) -> bytes:
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    ax, found = figure.subplots(), corrected.found
    for index, coordinate in enumerate(found.records.coordinates):
        change = found.motion[:, index] - found.path[:, index]
        ax.plot(_time(corrected), change, label=labelled(coordinate.name, coordinate.unit, " in "))
    ax.set(xlabel="time in s", ylabel="correction")
    ax.legend(fontsize="small", ncols=3)
    return png(figure)


def _time(corrected: Corrected) -> FloatArray:
    return np.asarray(corrected.surrogate.window.step * np.arange(len(corrected.found.path)))
