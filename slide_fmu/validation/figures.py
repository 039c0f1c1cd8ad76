"""The pictures of the report are PNG bytes; they are small, since released FMUs carry them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.stability import AmplitudeTest
from slide_fmu.validation.comparison import Comparison, Validation, relative_rmse
from slide_fmu.validation.motions import motions_of
from slide_fmu.validation.panels import (
    ERROR,
    ESTIMATE,
    REFERENCE,
    SCATTER_POINTS,
    SURROGATE,
    draw_inputs,
    panels_in_a_row,
)
from slide_fmu.validation.pictures import png as _png

SHOWN_SECONDS = 6.0
"""Length of the cut-out of a trajectory that a figure shows."""
SHOWN_SAMPLES = 8000
"""The cut-out has no more samples than these, since more of them are a black bar."""
PLOTTED = 1e6
"""Largest value drawn of a run that may grow without bound."""


def side_by_side(validation: Validation, output: int) -> bytes:
    """Draw both FMUs on the median and the worst trajectory, with error and estimate."""
    ranked = sorted(
        validation.comparisons, key=lambda c: relative_rmse(c.error, c.reference)[output]
    )
    chosen = {"median trajectory": ranked[len(ranked) // 2], "worst trajectory": ranked[-1]}
    if len(ranked) == 1:  # of a record there is often but one block
        chosen = {"the only trajectory": ranked[0]}
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
        middle.set_ylabel(f"{signal.name} / {signal.unit}")
        lower.plot(
            time, np.abs(comparison.error[shown, output]), color=ERROR, lw=0.8, label="|error|"
        )
        lower.plot(time, comparison.true_error[shown, output], color=REFERENCE, label="RMSE, true")
        if comparison.estimate is not None:
            filled = np.isfinite(comparison.true_error[shown, output])
            estimate = np.where(filled, comparison.estimate[shown, output], np.nan)
            lower.plot(time, estimate, color=ESTIMATE, label="RMSE, estimated")
        lower.set_ylabel(f"error / {signal.unit}")
        lower.set_xlabel("time / s")
        middle.legend(loc="upper right", fontsize=8)
        lower.legend(loc="upper right", fontsize=8)
    return _png(figure)


def estimate_scatter(validations: Mapping[str, Validation]) -> bytes:
    """Draw estimated over true error, a panel per validation; the band holds 37.5 % deviation."""
    figure, axes = panels_in_a_row(len(validations), 4.6)
    for ax, (title, validation) in zip(axes, validations.items(), strict=True):
        true = np.concatenate([c.true_error.ravel() for c in validation.comparisons])
        estimates = [c.estimate.ravel() for c in validation.comparisons if c.estimate is not None]
        estimate = np.concatenate(estimates)
        known = np.flatnonzero(~np.isnan(true))
        some = known[:: max(1, len(known) // SCATTER_POINTS)]
        ax.loglog(true[some], estimate[some], ".", ms=2, alpha=0.4, color=ESTIMATE)
        ends = np.array([true[some].min(), true[some].max()])
        ax.loglog(ends, ends, color=REFERENCE, lw=1)
        ax.fill_between(ends, 0.625 * ends, 1.375 * ends, color=REFERENCE, alpha=0.12)
        label = f"true RMSE over {validation.surrogate.estimated_samples} samples"
        ax.set(xlabel=label, ylabel="estimated", title=title)
    return _png(figure)


def excitation_bars(validation: Validation) -> bytes:
    """Draw the relative RMSE by kind of excitation, largest over the outputs."""
    rows = validation.figures()["excitations"]
    figure = Figure(figsize=(7, 0.6 + 0.45 * len(rows)), layout="constrained")
    ax = figure.subplots()
    names = [f"{row['name']} ({row['trajectories']})" for row in rows]
    values = [100 * max(row["relative_rmse"]) for row in rows]
    bars = ax.barh(names, values, color=SURROGATE)
    ax.bar_label(bars, fmt="%.3g %%", padding=3)
    ax.margins(x=0.15)
    ax.set_xlabel("relative RMSE / %   (number of trajectories in brackets)")
    ax.invert_yaxis()
    return _png(figure)


def training_history(histories: Mapping[str, Mapping[str, Sequence[float]]]) -> bytes:
    """Draw training and validation RMSE over the optimizer steps, one panel per stage."""
    # a course of one point shows nothing that the table beside does not say
    courses = {stage: h for stage, h in histories.items() if len(h["step"]) > 1} or histories
    figure, axes = panels_in_a_row(len(courses), 3.4)
    for ax, (stage, history) in zip(axes, courses.items(), strict=True):
        ax.semilogy(history["step"], history["training_error"], color=SURROGATE, label="training")
        ax.semilogy(history["step"], history["validation_error"], color=ERROR, label="validation")
        ax.set(xlabel="optimizer step or iteration", ylabel="error, scaled", title=stage)
        ax.legend(fontsize=8)
    return _png(figure)


def stability_tests(tests: Sequence[AmplitudeTest], step: float) -> bytes:
    """Draw two runs from different states per amplitude: they should meet and stay bounded."""
    figure = Figure(figsize=(11, 2.2 * len(tests)), layout="constrained")
    axes = figure.subplots(len(tests), 1, squeeze=False, sharex=True)[:, 0]
    for ax, test in zip(axes, tests, strict=True):
        time = step * np.arange(1, test.pair.shape[1] + 1)
        shown = np.clip(test.pair[:, :, 0], -PLOTTED, PLOTTED)
        ax.plot(time, shown[0], color=REFERENCE, label="from its own state")
        ax.plot(time, shown[1], "--", color=SURROGATE, label="from another state")
        verdict = "passed" if test.problem is None else "FAILED"
        ax.set_title(
            f"{test.amplitude:g} times the trained amplitude: {verdict}. Differences after one "
            f"window {np.median(test.differences):.2g} (median), {np.max(test.differences):.2g} "
            f"(worst, shown); growth {test.growth:.3g}",
            fontsize=9,
        )
        ax.set_ylabel("first output, scaled")
        ax.grid(alpha=0.3)
    axes[0].legend(loc="upper right", fontsize=8)
    axes[-1].set_xlabel("time / s")
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


def learning_curve(trajectories: Sequence[int], errors: Sequence[float]) -> bytes:
    """Draw validation errors over numbers of trajectories, both on logarithmic axes."""
    figure = Figure(figsize=(5.5, 2.8), layout="constrained")
    ax = figure.subplots()
    ax.loglog(trajectories, errors, "o-", color=SURROGATE)
    ax.set_xticks(trajectories, [str(number) for number in trajectories])
    ax.minorticks_off()
    ax.grid(alpha=0.3)
    ax.set(xlabel="trajectories", ylabel="validation error, scaled")
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
