"""This module draws charts of the training, and of the fading memory of system and network."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import NO_UNIT, ratio
from slide_fmu.core.web.charts import Axis, Chart, Line, Panel
from slide_fmu.fitting.history import CurvePoint, History
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.stability import AmplitudeTest
from slide_fmu.report.trust_charts import cumulative_shares
from slide_fmu.surrogate.surrogate import Surrogate

PLOTTED = 1e6
"""Largest value drawn of a run that may grow without bound."""

MOST_POINTS = 2000
"""A course has no more points than about these."""

FAR = 1e3
"""Errors larger than this many times the median validation error are left out of a course."""

ErrorName = Literal["training_error", "validation_error"]


def training_charts(histories: Mapping[str, History]) -> list[Chart]:
    """Draw training and validation error over the optimizer's steps, a chart per stage."""
    # a course of one point shows no more than the table next to it
    courses = {stage: h for stage, h in histories.items() if len(h.step) > 1}
    axis = Axis("optimizer step or iteration")
    return [
        Chart(
            stage,
            [
                Panel(
                    *_axis_of(history),
                    [
                        _course("training", history, "training_error", "line"),
                        _course("validation", history, "validation_error", "truth"),
                    ],
                    log=_positive(history),
                )
            ],
            axis,
        )
        for stage, history in courses.items()
    ]


def _axis_of(history: History) -> tuple[str, str]:
    """Return title and unit of the errors: errors of outputs are relative RMSE."""
    return ("relative RMSE", "%") if history.relative else ("error, scaled", NO_UNIT)


def _positive(history: History) -> bool:
    """Tell whether errors have logarithms; the loss of an error bound may be negative."""
    return bool(min(history.validation_error) > 0)


def _course(name: str, history: History, key: ErrorName, colour: str) -> Line:
    every = max(1, len(history.step) // MOST_POINTS)
    courses = history.step, getattr(history, key)
    step, error = (np.array(course, dtype=np.float64)[::every] for course in courses)
    error[error > _largest_shown(history)] = np.nan
    return Line(name, step, 100 * error if history.relative else error, colour)


def _largest_shown(history: History) -> float:
    """Return the largest error that is drawn: a start far from all solutions hides the course."""
    errors = np.asarray(history.validation_error, dtype=np.float64)
    errors = errors[np.isfinite(errors) & (errors > 0)]
    return FAR * float(np.median(errors)) if len(errors) else math.inf


def stability_charts(tests: Sequence[AmplitudeTest], step: float) -> list[Chart]:
    """Draw two runs from different states per amplitude: they should meet and stay bounded."""
    charts = []
    for test in tests:
        time = step * np.arange(1, test.pair.shape[1] + 1)
        shown = np.clip(test.pair[:, :, 0], -PLOTTED, PLOTTED)
        lines = [
            Line("from its own state", time, shown[0], "truth", dashed=True, width=3.0),
            Line("from another state", time, shown[1], width=1.4),
        ]
        verdict = "passed" if test.problem is None else "FAILED"
        middle, worst = (percent(float(f(test.differences))) for f in (np.median, np.max))
        charts.append(
            Chart(
                f"{test.amplitude:g} times the trained amplitude: {verdict}",
                [Panel("first output, scaled", "1", lines)],
                text=(
                    f"differences after one window {middle} (median), {worst} (worst, drawn); "
                    f"growth {decimal(test.growth)}"
                ),
            )
        )
    return charts


def decay_chart(linearized: Decay | None, measured: Decay, truncation_time: float) -> Chart:
    """Draw the share of motions that have forgotten over time in s.

    A dotted line marks the window's truncation. Linearized decay times are drawn
    where the system offers them.
    """
    courses = [("measured (two motions)", measured, "truth")]
    if linearized is not None:
        courses.insert(0, ("linearized (eigenvalues)", linearized, "line"))
    times = [time for _, decay, _ in courses for time in decay.times if math.isfinite(time)]
    ends, lines = (0.0, 1.1 * max([truncation_time, *times])), []
    for name, decay, colour in courses:
        lines.append(Line(name, *cumulative_shares(decay.times.tolist(), ends), colour, "steps"))
        if math.isfinite(decay.mean):
            upright = np.array([decay.mean, decay.mean]), np.array([0.0, 100.0])
            lines.append(Line(f"{name}, mean rate", *upright, colour, dashed=True))
    panel = Panel("motions that have forgotten by then", "%", lines, include=(0.0, 100.0))
    return Chart("Decay times", [panel], Axis("decay time", "s"), marks=[truncation_time])


def response_charts(learnt: FloatArray, exact: FloatArray, surrogate: Surrogate) -> list[Chart]:
    """Draw the newest row of the learnt response matrix of each output and the exact one.

    The panel below shows the largest deviation in a column of all rows. Both matrices have the
    shape of ``slide_fmu.validation.response.learnt_matrix``; a column is an input sample.
    """
    charts, n_inputs, n_outputs = [], len(surrogate.inputs), len(surrogate.outputs)
    for output, other in enumerate(surrogate.outputs):
        for channel, one in enumerate(surrogate.inputs):
            own, true = (m[output::n_outputs, channel::n_inputs] for m in (learnt, exact))
            sample = np.arange(1.0, own.shape[1] + 1)
            unit = ratio(other.unit, one.unit)
            deviation = np.abs(own - true).max(axis=0)
            lines = [
                Line("exact", sample, true[-1], "truth", dashed=True, width=3.0),
                Line("learnt", sample, own[-1]),
            ]
            panels = [
                Panel("response of the newest output sample", unit, lines),
                Panel(
                    "largest deviation of all output samples",
                    unit,
                    [Line("deviation", sample, deviation, "bad")],
                    height="short",
                ),
            ]
            charts.append(Chart(f"{one.name} to {other.name}", panels, Axis("input sample")))
    return charts


def curve_chart(points: Sequence[CurvePoint]) -> Chart:
    """Draw validation and training errors over numbers of trajectories."""
    count = np.array([point.trajectories for point in points], dtype=np.float64)
    lines = []
    for name, key, colour in (
        ("validation", "validation_error", "truth"),
        ("training", "training_error", "line"),
    ):
        error = np.array([getattr(point, key) for point in points], dtype=np.float64)
        lines.append(Line(name, count, error, colour))
        lines.append(Line("", count, error, colour, "points", width=3.0))
    panel = Panel("error, scaled", "1", lines, log=True)
    return Chart("Error by number of trajectories", [panel], Axis("trajectories", log=True))
