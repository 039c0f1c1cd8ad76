"""Sections of a report show how a surrogate was learnt: its window, its sizes, its memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slide_fmu.memory.decay_figures import decay_rows
from slide_fmu.memory.sizing import AnySizing, Sizing
from slide_fmu.memory.stability import AmplitudeTest
from slide_fmu.report import figures
from slide_fmu.report.learning_charts import (
    curve_chart,
    stability_charts,
    training_charts,
)
from slide_fmu.report.report import Section
from slide_fmu.report.tables import curve_rows, scientific, size_rows

EIGENVALUES = (
    "from the eigenvalues of the equations linearized along motions, by their mean rate over "
    "stretches of the motions, and measured as the time in which two motions under the same "
    "input meet. At an instant on the way the slowest mode may decay more slowly, or grow "
    "(without end): what counts is the mean."
)

MEASURED_ALONE = (
    "measured as the time in which two motions under the same input meet. The system does not "
    "offer its linearized equations, so the mean rate of the pairs of motions decides."
)
"""How decay times were found, as the report says it."""

FITTED = (
    "from the slowest pole of a linear model that was fitted to the records, with the 95 % "
    "interval of that fit. How long the fitted network itself remembers is tested below."
)


def sizing_section(sizing: AnySizing) -> Section:
    """Show how long the system remembers its initial state, and what the window truncates."""
    window = sizing.window
    found = MEASURED_ALONE
    if not isinstance(sizing, Sizing):
        found = FITTED
    elif sizing.linearized:
        found = EIGENVALUES
    text = (
        f"Time until initial effects have decayed to {sizing.remaining_amplitude:g} of their "
        f"amplitude: {found} The window truncates "
        f"{window.n_in} - {window.n_out} samples, {window.truncation_time:.4g} s."
    )
    if sizing.remark is not None:
        text += f" Remark: {sizing.remark}."
    if not isinstance(sizing, Sizing):
        return Section("Window", text, decay_rows(sizing.figures()))
    linearized = None if sizing.linearized is None else sizing.linearized.decay
    picture = figures.decay_times(linearized, sizing.measured, window.truncation_time)
    return Section("Window", text, decay_rows(sizing.figures()), [picture])


def stability_section(tests: Sequence[AmplitudeTest], step: float) -> Section:
    """Show whether the network has fading memory and stays bounded beyond its amplitude."""
    rows = [("amplitude", "median difference", "largest difference", "growth", "test")]
    for test in tests:
        gaps = float(np.median(test.differences)), float(np.max(test.differences))
        verdict = "passed" if test.problem is None else test.problem
        rows.append(
            (
                f"{test.amplitude:g} x",
                scientific(gaps[0]),
                scientific(gaps[1]),
                f"{test.growth:.3g}",
                verdict,
            )
        )
    return Section(
        "Fading memory and boundedness",
        "Two runs from different states under the same inputs, after one window, relative to the "
        "output's standard deviation; and the largest output, relative to that at the trained "
        "amplitude times the factor (growth). Beyond the trained amplitude systems may have "
        "several lasting responses: there the median pair counts.",
        rows,
        charts=stability_charts(tests, step),
    )


def training_section(histories: Mapping[str, Mapping[str, Any]]) -> Section:
    """Show how the trainings went."""
    rows = [("stage", "steps or iterations", "best validation error")]
    for stage, history in histories.items():
        best = min(history["validation_error"])
        error = f"{100 * best:.3g} %" if history.get("relative") else f"{best:.4g}, scaled"
        rows.append((stage, str(history["step"][-1]), error))
    return Section(
        "Training",
        "The weights of the best validation are kept. Errors in per cent are relative RMSE of the "
        "outputs, over their standard deviation. Others are RMSE in scaled units, weighted "
        "by the spectrum of the outputs' noise where a noise record is named; of the "
        "estimator at single samples, where it learns by likelihood, a mean standard deviation, "
        "and then the mean deviation of its scaled logarithm.",
        rows,
        charts=training_charts(histories),
    )


def sizes_section(sizes: Sequence[Mapping[str, Any]], remark: str | None) -> Section:
    """Show which sizes of the network were tried, and what remains to be learnt."""
    text = (
        "Validation errors are RMSE in scaled units, after the short runs by which a size is "
        "judged; the chosen one is trained longer. What is learnable could be predicted from the "
        "inputs by a regression on the residual; no figure: the search did not ask."
    )
    text += "" if remark is None else f" Remark: {remark}."
    return Section("Sizes tried", text, size_rows(sizes))


def curve_section(curve: Mapping[str, Any]) -> Section:
    """Show how the error fell with the number of trajectories."""
    points = curve["points"]
    return Section(
        "Learning curve",
        "Validation error of a network of moderate size, scaled, that learns from twice as many "
        f"trajectories at each point. The curve ended: {curve['ended']}.",
        curve_rows(curve),
        charts=[curve_chart(points)],
    )
