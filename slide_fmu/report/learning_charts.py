"""Charts of how a surrogate was learnt, and of how its network forgets and stays bounded."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slide_fmu.core.units import NO_UNIT
from slide_fmu.core.web.charts import Axis, Chart, Line, Panel
from slide_fmu.memory.stability import AmplitudeTest

PLOTTED = 1e6
"""Largest value drawn of a run that may grow without bound."""

MOST_POINTS = 2000
"""A course has no more points than about these."""

FAR = 1e3
"""Errors of more than so many times the median of the validations are left out of a course."""

History = Mapping[str, Any]


def training_charts(histories: Mapping[str, History]) -> list[Chart]:
    """Draw training and validation error over the optimizer's steps, a chart per stage."""
    # a course of one point shows nothing that the table beside does not say
    courses = {stage: h for stage, h in histories.items() if len(h["step"]) > 1}
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
    """Return title and unit of the errors: those of outputs are relative RMSE."""
    return ("relative RMSE", "%") if history.get("relative") else ("error, scaled", NO_UNIT)


def _positive(history: History) -> bool:
    """Tell whether errors have logarithms; the loss of an error bound may be negative."""
    return bool(min(history["validation_error"]) > 0)


def _course(name: str, history: History, key: str, colour: str) -> Line:
    every = max(1, len(history["step"]) // MOST_POINTS)
    step, error = (np.array(history[k], dtype=np.float64)[::every] for k in ("step", key))
    error[error > _largest_shown(history)] = np.nan
    return Line(name, step, 100 * error if history.get("relative") else error, colour)


def _largest_shown(history: History) -> float:
    """Return the largest error that is drawn: a start far from all solutions hides the course."""
    errors = np.asarray(history["validation_error"], dtype=np.float64)
    errors = errors[np.isfinite(errors) & (errors > 0)]
    return FAR * float(np.median(errors)) if len(errors) else math.inf


def stability_charts(tests: Sequence[AmplitudeTest], step: float) -> list[Chart]:
    """Draw two runs from different states per amplitude: they should meet and stay bounded."""
    found = []
    for test in tests:
        time = step * np.arange(1, test.pair.shape[1] + 1)
        shown = np.clip(test.pair[:, :, 0], -PLOTTED, PLOTTED)
        lines = [
            Line("from its own state", time, shown[0], "truth", dashed=True, width=3.0),
            Line("from another state", time, shown[1], width=1.4),
        ]
        verdict = "passed" if test.problem is None else "FAILED"
        found.append(
            Chart(
                f"{test.amplitude:g} times the trained amplitude: {verdict}",
                [Panel("first output, scaled", "1", lines)],
                text=(
                    f"differences after one window {np.median(test.differences):.2g} (median), "
                    f"{np.max(test.differences):.2g} (worst, drawn); growth {test.growth:.3g}"
                ),
            )
        )
    return found


def curve_chart(points: Sequence[Mapping[str, Any]]) -> Chart:
    """Draw validation and training errors over numbers of trajectories."""
    count = np.array([point["trajectories"] for point in points], dtype=np.float64)
    lines = []
    for name, key, colour in (
        ("validation", "validation_error", "truth"),
        ("training", "training_error", "line"),
    ):
        error = np.array([point[key] for point in points], dtype=np.float64)
        lines.append(Line(name, count, error, colour))
        lines.append(Line("", count, error, colour, "points", width=3.0))
    panel = Panel("error, scaled", "1", lines, log=True)
    return Chart("Error by number of trajectories", [panel], Axis("trajectories", log=True))
