"""This module makes the sections of a report on training, window, sizes and memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slide_fmu.core.readable import decimal
from slide_fmu.fitting.history import Curve, History, SizeTrial
from slide_fmu.memory.sizing import AnySizing, Sizing
from slide_fmu.memory.stability import AmplitudeTest
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.learning_charts import (
    curve_chart,
    decay_chart,
    stability_charts,
    training_charts,
)
from slide_fmu.report.learning_tables import (
    curve_table,
    decay_table,
    size_table,
    stability_table,
    training_table,
)

EIGENVALUES = (
    "from the eigenvalues of the equations linearized along motions, by their mean rate over "
    "pieces of the motions, and measured as the time in which two motions under the same "
    "input meet. At single instants the slowest mode may even grow; its mean along the motion "
    "decides."
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


def sizing_section(sizing: AnySizing) -> ReportSection:
    """Show how long the system remembers its initial state, and what the window truncates."""
    window = sizing.window
    method = MEASURED_ALONE
    if not isinstance(sizing, Sizing):
        method = FITTED
    elif sizing.linearized:
        method = EIGENVALUES
    left = decimal(sizing.remaining_amplitude)
    text = (
        f"Time until initial effects have decayed to {left} of their "
        f"amplitude: {method} The window truncates "
        f"{window.n_in} - {window.n_out} samples, {decimal(window.truncation_time, 4)} s."
    )
    if sizing.remark is not None:
        text += f" Remark: {sizing.remark}."
    if not isinstance(sizing, Sizing):
        return ReportSection("Window", text, decay_table(sizing.figures()))
    linearized = None if sizing.linearized is None else sizing.linearized.decay
    charts = [decay_chart(linearized, sizing.measured, window.truncation_time)]
    return ReportSection("Window", text, decay_table(sizing.figures()), charts=charts)


def stability_section(tests: tuple[AmplitudeTest, ...], step: float) -> ReportSection:
    """Show whether the network has fading memory and stays bounded beyond its amplitude."""
    return ReportSection(
        "Fading memory and boundedness",
        "Two runs from different states under the same inputs, after one window, relative to the "
        "output's standard deviation; and the largest output, relative to that at the trained "
        "amplitude times the factor (growth). Beyond the trained amplitude systems may have "
        "several lasting responses: there the median pair counts.",
        stability_table(tests),
        charts=stability_charts(tests, step),
    )


def training_section(histories: Mapping[str, History]) -> ReportSection:
    """Show steps and errors of the trainings."""
    return ReportSection(
        "Training",
        "Training loss: lower is better, and units differ between stages. The weights of the best "
        "validation are kept. Losses in per cent are relative RMSE of the outputs, over their "
        "standard deviation. The loss of an error bound may be negative.",
        training_table(histories),
        charts=training_charts(histories),
    )


def sizes_section(
    sizes: Sequence[SizeTrial], explanations: Sequence[str], remark: str | None
) -> ReportSection:
    """Show the sizes of the network that were tried, and the part of the error still learnable."""
    text = (
        "Validation errors are RMSE in scaled units, after the short runs by which a size is "
        "judged. The chosen one is trained longer. A regression on the residual says which error "
        "could still be learnt from the inputs. It was not needed where there is no figure."
    )
    text += "".join(f" {sentence}." for sentence in explanations)
    text += "" if remark is None else f" Remark: {remark}."
    return ReportSection("Sizes tried", text, size_table(sizes))


def curve_section(curve: Curve) -> ReportSection:
    """Show how the error fell with the number of trajectories."""
    return ReportSection(
        "Learning curve",
        "Validation error of a network of moderate size, scaled, that learns from twice as many "
        f"trajectories at each point. The curve ended: {curve.ended}.",
        curve_table(curve),
        charts=[curve_chart(curve.points)],
    )
