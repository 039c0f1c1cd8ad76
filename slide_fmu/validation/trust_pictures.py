"""Pictures of how far error bounds hold, and of what the FMU says where they do not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.validation.comparison import Validation
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
from slide_fmu.validation.trust import TINY
from slide_fmu.validation.worst_steps import WorstStep, error_over_bound, worst_steps

WORST_STEPS = 10
"""So many of the worst steps are drawn."""

SHOWN_SECONDS = 3.0
"""A worst step is drawn with so much time around it."""

SMALLEST_SHOWN = 1e-3
"""Errors below this part of their median are drawn at this part: they hit zero by chance."""


def bound_scatter(validations: Mapping[str, Validation]) -> bytes:
    """Draw bounds over absolute errors, a panel per validation; covered points lie above a line.

    Both are relative to the RMS of the outputs' reference in the first validation.
    """
    main = next(iter(validations.values()))
    scale = rms(np.concatenate([c.reference for c in main.trusted])) + TINY
    figure, axes = panels_in_a_row(len(validations), 4.6)
    for ax, (title, validation) in zip(axes, validations.items(), strict=True):
        error, bound, inside = [], [], []
        for c in validation.trusted:
            assert c.told is not None
            error.append((np.abs(c.error) / scale).ravel())
            bound.append((c.told.bounds / scale).ravel())
            inside.append(np.repeat(c.told.in_domain == 1, c.error.shape[1]))
        errors, bounds = _drawn(np.concatenate(error)), np.concatenate(bound)
        _inside_and_outside(ax, errors, bounds, np.concatenate(inside))
        ends = np.array([min(errors.min(), bounds.min()), max(errors.max(), bounds.max())])
        ax.loglog(ends, ends, color=REFERENCE, lw=1, label="error = bound")
        ax.set(
            xlim=(0.7 * errors.min(), 1.4 * errors.max()),
            ylim=(0.7 * bounds.min(), 1.4 * bounds.max()),
            xlabel="|error| over the output's RMS",
            ylabel=f"bound ({_percent(USUAL_CONFIDENCE)} confidence) over the same",
            title=f"{title}: above the line, the bound holds",
        )
        _legend(ax)
    return _png(figure)


def novelty_scatter(validations: Mapping[str, Validation]) -> bytes:
    """Draw errors over their bounds, the worst output's, over the novelty of the inputs."""
    figure, axes = panels_in_a_row(len(validations), 4.6)
    for ax, (title, validation) in zip(axes, validations.items(), strict=True):
        told = [c.told for c in validation.trusted if c.told is not None]
        novelty = np.concatenate([one.novelty for one in told])
        inside = np.concatenate([one.in_domain == 1 for one in told])
        ratios = [error_over_bound(c).max(axis=1) for c in validation.trusted]
        ratio = _drawn(np.concatenate(ratios))
        _inside_and_outside(ax, np.maximum(novelty, TINY), ratio, inside)
        ax.axhline(1, color=REFERENCE, lw=1)
        ax.axvline(1, color=REFERENCE, lw=1, ls="--")
        silent = float(np.mean((ratio > 1) & inside))
        ax.set(
            xlabel="novelty (dashed: edge of the domain)",
            ylabel="|error| over its bound",
            title=f"{title}: {_percent(silent)} not covered, in the domain",
        )
        _legend(ax)
    return _png(figure)


def coverage_by_kind(validations: Mapping[str, Validation]) -> bytes:
    """Draw the covered share of every trajectory by kind of excitation, the least of the outputs.

    The line of a kind is the mean of its trajectories.
    """
    kinds = {name: motions_of(v.recipe) for name, v in validations.items()}
    figure, axes = panels_in_a_row(len(validations), 1.4 + 0.42 * max(map(len, kinds.values())))
    for ax, (title, validation) in zip(axes, validations.items(), strict=True):
        labels, names = [], [motion.name for motion in kinds[title]]
        for row, name in enumerate(names):
            chosen = [c for c in validation.trusted if c.kind == row]
            labels.append(f"{name} ({len(chosen)})")
            shares = [100 * float((error_over_bound(c) <= 1).mean(axis=0).min()) for c in chosen]
            if shares:
                mean = float(np.mean(shares))
                ax.plot([mean, mean], [row - 0.34, row + 0.34], color=ERROR, lw=2)
                heights = row + np.linspace(-0.22, 0.22, len(shares) + 2)[1:-1]
                ax.plot(shares, heights, ".", color=SURROGATE, ms=6, alpha=0.8)
        ax.axvline(100 * USUAL_CONFIDENCE, color=REFERENCE, ls="--", lw=1)
        ax.set_yticks(range(len(names)), labels)
        ax.set(ylim=(len(names) - 0.5, -0.5), title=title)
        ax.set_xlabel("covered samples / %\n(dot: trajectory, red: mean, dashed: confidence)")
    return _png(figure)


def worst_steps_picture(validation: Validation) -> bytes:
    """Draw the steps with the largest errors over their bounds, with what led to them."""
    step = validation.surrogate.window.step
    around = max(2, round(0.5 * SHOWN_SECONDS / step))
    worst = worst_steps(validation.trusted, WORST_STEPS, 2 * around)
    rows = -(-len(worst) // 2)
    with rc_context({"font.size": 8}):
        figure = Figure(figsize=(11, 2.3 * rows + 0.4), layout="constrained")
        panels = figure.subfigures(rows, 2, squeeze=False).ravel()
        for panel, found in zip(panels, worst, strict=False):
            upper, lower = panel.subplots(2, 1, sharex=True, height_ratios=(1, 1.6))
            _draw_step(upper, lower, validation, found, around)
        handles, labels = lower.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        return _png(figure)


def _draw_step(
    upper: Axes, lower: Axes, validation: Validation, found: WorstStep, around: int
) -> None:
    """Draw the inputs, and below them error and bound; what is outside of the domain is grey."""
    comparison, told = found.comparison, found.comparison.told
    assert told is not None
    first = max(0, min(found.sample - around, len(comparison.time) - 2 * around))
    shown = slice(first, first + 2 * around)
    time, signal = comparison.time[shown], validation.surrogate.outputs[found.output]
    kind = motions_of(validation.recipe)[comparison.kind].name
    upper.set_title(f"{kind}: {signal.name} errs by {found.ratio:.3g} times its bound")
    draw_inputs(upper, validation.surrogate.inputs, time, comparison.inputs[shown])
    error = np.abs(comparison.error[shown, found.output])
    bound = told.bounds[shown, found.output]
    lower.fill_between(time, 0, bound, step="mid", color=ESTIMATE, alpha=0.25, lw=0)
    lower.step(time, bound, where="mid", color=ESTIMATE, lw=1.2, label="bound")
    lower.plot(time, error, ".-", color=ERROR, lw=0.9, ms=3, label="|error|")
    worst = comparison.time[found.sample]
    lower.axvline(worst, color=REFERENCE, lw=0.8, ls=":", label="the worst step")
    outside = told.in_domain[shown] == 0
    for ax in (upper, lower):
        ax.fill_between(
            time,
            0,
            1,
            where=outside,
            step="mid",
            transform=ax.get_xaxis_transform(),
            color=REFERENCE,
            alpha=0.2,
            lw=0,
            label="in_domain is false",
        )
    lower.set_ylim(bottom=0)
    lower.set_ylabel(f"{signal.name} / {signal.unit}")
    lower.set_xlabel("time / s")
    lower.margins(x=0)


def _inside_and_outside(ax: Axes, x: FloatArray, y: FloatArray, inside: FloatArray) -> None:
    """Draw points on logarithmic axes, those outside of the domain in a colour of their own.

    Those outside are few, so that they are thinned out by themselves.
    """
    parts = ((True, SURROGATE, "in the domain"), (False, ERROR, "outside of the domain"))
    for wanted, colour, label in parts:
        known = np.flatnonzero(inside == wanted)
        some = known[:: max(1, len(known) // SCATTER_POINTS)]
        if len(some):
            ax.loglog(x[some], y[some], ".", ms=2, alpha=0.4, color=colour, label=label)


def _legend(ax: Axes) -> None:
    """Show what the points are, as large ones."""
    legend = ax.legend(loc="lower right", fontsize=8, markerscale=4)
    for handle in legend.legend_handles:
        if handle is not None:
            handle.set_alpha(1.0)


def _drawn(values: FloatArray) -> FloatArray:
    """Return values, (N,), kept from zero, so that the rest of a logarithmic axis is seen."""
    return np.maximum(values, max(SMALLEST_SHOWN * float(np.median(values)), TINY))


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
