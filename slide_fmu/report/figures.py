"""The pictures of the report are PNG bytes; they are small, since released FMUs carry them."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import labelled
from slide_fmu.memory.decay import Decay
from slide_fmu.report.panels import (
    ERROR,
    ESTIMATE,
    REFERENCE,
    SURROGATE,
    draw_inputs,
)
from slide_fmu.report.pictures import png as _png
from slide_fmu.report.trajectory_charts import ranked
from slide_fmu.validation.comparison import Comparison, Validation
from slide_fmu.validation.motions import motions_of

SHOWN_SECONDS = 6.0
"""Length of the cut-out of a trajectory that a figure shows."""
SHOWN_SAMPLES = 8000
"""The cut-out has no more samples than these, since more of them are a black bar."""


def side_by_side(validation: Validation, output: int) -> bytes:
    """Draw both FMUs on the median and the worst trajectory, with error and estimate."""
    chosen = dict(reversed(ranked(validation, output).items()))
    measured = validation.recipe.system.is_record
    figure = Figure(figsize=(11, 7.2), layout="constrained")
    axes = figure.subplots(3, len(chosen), sharex="col", height_ratios=(1, 2, 1.3), squeeze=False)
    signal = validation.surrogate.outputs[output]
    for column, (title, comparison) in enumerate(chosen.items()):
        kind = motions_of(validation.recipe)[comparison.kind].name
        shown = _worst_part(comparison, output)
        time = comparison.time[shown]
        upper, middle, lower = axes[:, column]
        upper.set_title(f"{title} ({kind}),\naround its largest error", fontsize=11)
        draw_inputs(upper, validation.surrogate.inputs, time, comparison.inputs[shown])
        label = "measured" if measured else "reference"
        middle.plot(time, comparison.reference[shown, output], color=REFERENCE, label=label)
        middle.plot(
            time, comparison.surrogate[shown, output], "--", color=SURROGATE, label="surrogate FMU"
        )
        middle.set_ylabel(labelled(signal.name, signal.unit))
        lower.plot(
            time, np.abs(comparison.error[shown, output]), color=ERROR, lw=0.8, label="|error|"
        )
        true_error = comparison.true_error[shown, output]
        filled = np.isfinite(true_error)
        if filled.any():  # the span may reach before all that is shown
            lower.plot(time, true_error, color=REFERENCE, label="RMSE, true")
        if filled.any() and comparison.estimate is not None:
            estimate = np.where(filled, comparison.estimate[shown, output], np.nan)
            lower.plot(time, estimate, color=ESTIMATE, label="RMSE, estimated")
        lower.set_ylabel(labelled("error", signal.unit))
        lower.set_xlabel("time / s")
        middle.legend(loc="upper right", fontsize=8)
        lower.legend(loc="upper right", fontsize=8)
    return _png(figure)


def decay_times(linearized: Decay | None, measured: Decay, truncation_time: float) -> bytes:
    """Draw decay times, linearized (where they are) and measured, and the window's truncation.

    The truncation time is in s.
    """
    rows = [("measured\n(two motions)", measured, ESTIMATE)]
    if linearized is not None:
        rows.insert(0, ("linearized\n(eigenvalues)", linearized, SURROGATE))
    figure = Figure(figsize=(7, 1.2 + len(rows)), layout="constrained")
    ax = figure.subplots()
    for row, (_, decay, color) in enumerate(rows):
        heights = row + np.linspace(-0.25, 0.25, len(decay.times))
        ax.plot(decay.times, heights, ".", color=color, ms=5)
        ax.plot([decay.mean, decay.mean], [row - 0.35, row + 0.35], color=color, lw=2)
    ax.axvline(truncation_time, color=REFERENCE, ls="--")
    ax.annotate(
        "truncated by the window",
        (truncation_time, 0.5 * (len(rows) - 1)),
        rotation=90,
        ha="right",
        va="center",
        xytext=(-4, 0),
        textcoords="offset points",
        fontsize=8,
    )
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    ax.set(xlabel="decay time / s   (line: of the mean rate)", ylim=(len(rows) - 0.4, -0.6))
    shown = np.concatenate([*(decay.times for _, decay, _ in rows), [truncation_time]])
    ax.set_xlim(0, 1.1 * float(np.max(shown[np.isfinite(shown)])))
    return _png(figure)


def response_matrices(learnt: FloatArray, exact: FloatArray) -> bytes:
    """Draw the learnt response matrix, the exact one, and their difference (paper's heatmap)."""
    figure = Figure(figsize=(11, 6.4), layout="constrained")
    axes = figure.subplots(3, 1)
    largest = float(np.max(np.abs(exact)))
    rows = (
        ("learnt", learnt, largest),
        ("exact discrete response", exact, largest),
        ("difference", learnt - exact, float(np.max(np.abs(learnt - exact)))),
    )
    for ax, (title, matrix, limit) in zip(axes, rows, strict=True):
        image = ax.imshow(matrix, cmap="RdBu", vmin=-limit, vmax=limit, aspect="auto")
        ax.set(title=title, ylabel="output sample")
        figure.colorbar(image, ax=ax)
    axes[-1].set_xlabel("input sample")
    return _png(figure)


def _worst_part(comparison: Comparison, output: int) -> slice:
    """Return the samples around the largest error."""
    step = comparison.time[1] - comparison.time[0] if len(comparison.time) > 1 else 1.0
    count = min(len(comparison.time), round(SHOWN_SECONDS / step), SHOWN_SAMPLES)
    worst = int(np.argmax(np.abs(comparison.error[:, output])))
    first = min(max(0, worst - count // 2), len(comparison.time) - count)
    return slice(first, first + count)
