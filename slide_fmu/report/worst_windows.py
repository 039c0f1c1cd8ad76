"""This module shows the windows with the largest errors, and the inputs that led there."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.measures import TINY, percent, rms
from slide_fmu.core.readable import ratio_text
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.web.charts import Chart
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.trajectory_charts import (
    NOT_TRUSTED,
    error_panel,
    inputs_panel,
    name_of_motion,
    outputs_panel,
    outside_parts,
)
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation
from slide_fmu.validation.worst_steps import WorstStep, error_over_bound, worst_steps

WINDOWS = 3
"""Number of worst windows that are drawn."""

MOST_BEFORE = 400
"""A window is drawn with no more samples than these before its worst one."""

FEWEST_BEFORE = 20


def worst_section(validation: Validation) -> ReportSection | None:
    """Return the section on the worst windows; None where no sample counts."""
    bounded = bool(validation.trusted)
    scale = "their bounds" if bounded else "the RMS of the reference about its mean"
    found = _worst(validation)
    if not found:
        return None
    text = (
        f"These are the samples whose errors are largest relative to {scale}, one of each "
        "trajectory at most where there are enough of them, with the inputs that the surrogate "
        "saw before."
    )
    charts = [_chart(validation, step, bounded) for step in found]
    return ReportSection("The worst windows", text, charts=charts)


def _worst(validation: Validation) -> list[WorstStep]:
    before = _before(validation)
    if validation.trusted:
        return worst_steps(validation.trusted, WINDOWS, before, error_over_bound)
    scale = rms(np.concatenate([c.reference - validation.mean for c in validation.comparisons]))

    def ratio(comparison: Comparison) -> FloatArray:
        return np.asarray(np.abs(comparison.error) / np.maximum(scale, TINY))

    return worst_steps(validation.comparisons, WINDOWS, before, ratio)


def _before(validation: Validation) -> int:
    """Return how many samples are drawn before a worst one: the memory of the surrogate."""
    memory = validation.surrogate.network.memory_length
    return min(max(memory, FEWEST_BEFORE), MOST_BEFORE)


def _chart(validation: Validation, step: WorstStep, bounded: bool) -> Chart:
    comparison, before = step.comparison, _before(validation)
    first = max(0, step.sample - before)
    part = slice(first, step.sample + before // 4 + 1)
    signal = validation.surrogate.outputs[step.output]
    kind = name_of_motion(validation, comparison)
    size = (
        f"{ratio_text(step.ratio)} times its bound"
        if bounded
        else f"{percent(step.ratio)} of the RMS"
    )
    return Chart(
        f"{signal.name} has an error of {size}",
        [
            inputs_panel(validation, comparison.time[part], comparison.inputs[part]),
            outputs_panel(validation, comparison, part, step.output),
            error_panel(validation, comparison, part, step.output),
        ],
        text=f"{kind}, at {comparison.time[step.sample]:.6g} s",
        parts=outside_parts(comparison, part),
        marks=[float(comparison.time[step.sample])],
        shaded=NOT_TRUSTED,
    )
