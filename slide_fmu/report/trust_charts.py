"""This module draws charts of error estimates and error bounds over all samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import TINY, percent, rms
from slide_fmu.core.readable import ratio_text
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind
from slide_fmu.core.web.charts import Axis, Band, Chart, Line, Panel, colour_of
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.report.trajectory_charts import NOT_TRUSTED, parts_of, signals_panel
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.adversarial import MeasuredInputs
from slide_fmu.validation.results import Validation
from slide_fmu.validation.worst_steps import error_over_bound

SCATTER_POINTS = 3000
"""Approximate largest number of points of a panel; more points would hide each other."""

SMALLEST_SHOWN = 1e-3
"""Errors below this part of their median are drawn at this part: they hit zero by chance."""

SMALLEST_RATIO, RATIO_BAR = 1e-2, 0.1
"""Left end of a histogram of errors over bounds, and the decades that a bar is wide."""

BEFORE_WORST = 120
"""Samples that are drawn before the worst one of a search; a fourth as many are drawn after it."""

BAND = 0.375
"""The band about the diagonal holds relative deviations of an estimate up to this."""


def estimate_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw estimated over true errors, a chart per validation, where some are positive."""
    charts = []
    for title, validation in validations.items():
        unit = validation.surrogate.outputs[0].unit
        true = np.concatenate([c.true_error.ravel() for c in validation.used])
        parts = [c.estimate.ravel() for c in validation.used if c.estimate is not None]
        estimate = np.concatenate(parts)
        some = _thinned((true > 0) & (estimate > 0))
        if not len(some):
            continue
        ends = np.array([true[some].min(), true[some].max()])
        panel = Panel(
            "estimated",
            unit,
            [_points("", true[some], estimate[some], "estimate"), _diagonal("equal", ends)],
            [Band(f"{percent(BAND)} off", ends, (1 - BAND) * ends, (1 + BAND) * ends, "shade")],
            log=True,
            height="square",
        )
        label = f"true RMSE over {validation.surrogate.estimated_samples} samples"
        charts.append(Chart(title, [panel], Axis(label, behind(unit).strip(), log=True)))
    return charts


def bound_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw bounds over absolute errors, a chart per validation; covered points lie above a line.

    Both are relative to the RMS about its mean of the outputs' reference in the first validation.
    """
    main = next(iter(validations.values()))
    scale = rms(np.concatenate([c.reference - main.mean for c in main.trusted])) + TINY
    charts = []
    for title, validation in validations.items():
        error, bound, inside = [], [], []
        for c in validation.trusted:
            assert c.trust is not None
            error.append((np.abs(c.error) / scale).ravel())
            bound.append((c.trust.bounds / scale).ravel())
            inside.append(np.repeat(c.trust.in_domain == 1, c.error.shape[1]))
        errors, bounds = _drawn(np.concatenate(error)), np.concatenate(bound)
        ends = np.array([min(errors.min(), bounds.min()), max(errors.max(), bounds.max())])
        lines = [
            *_inside_and_outside(errors, bounds, np.concatenate(inside)),
            _diagonal("error = bound", ends),
        ]
        panel = Panel(
            f"bound ({percent(USUAL_CONFIDENCE)} confidence) over the output's RMS",
            "1",
            lines,
            log=True,
            height="square",
        )
        axis = Axis("|error| over the output's RMS", log=True)
        charts.append(Chart(f"{title}: above the line, the bound holds", [panel], axis))
    return charts


def novelty_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw errors over their bounds, the worst output's, over the novelty of the inputs."""
    charts = []
    for title, validation in validations.items():
        answers = [c.trust for c in validation.trusted if c.trust is not None]
        novelty = np.maximum(np.concatenate([one.novelty for one in answers]), TINY)
        inside = np.concatenate([one.in_domain == 1 for one in answers])
        ratios = [error_over_bound(c).max(axis=1) for c in validation.trusted]
        ratio = _drawn(np.concatenate(ratios))
        ends = np.array([novelty.min(), max(novelty.max(), 1.0)])
        lines = [
            *_inside_and_outside(novelty, ratio, inside),
            Line("error = bound", ends, np.ones(2), "cursor", width=1.0),
            Line(
                *("edge of the domain", np.ones(2), np.array([ratio.min(), ratio.max()])),
                colour="cursor",
                dashed=True,
                width=1.0,
            ),
        ]
        silent = float(np.mean((ratio > 1) & inside))
        panel = Panel("|error| over its bound", "1", lines, log=True, height="square")
        heading = f"{title}: {percent(silent)} not covered, in the domain"
        charts.append(Chart(heading, [panel], Axis("novelty", log=True)))
    return charts


def coverage_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw how many trajectories of each kind are covered less than a share of their samples.

    The share of a trajectory is the smallest of its outputs.
    """
    charts = []
    for title, validation in validations.items():
        shares: dict[int, list[float]] = {}
        for c in validation.trusted:
            least = 100 * float((error_over_bound(c) <= 1).mean(axis=0).min())
            shares.setdefault(c.kind, []).append(least)
        ends = min(map(min, shares.values())), 100.0
        lines = [
            Line(
                f"{motion.name} ({len(shares[row])})",
                *cumulative_shares(shares[row], ends),
                colour_of(row),
                "steps",
            )
            for row, motion in enumerate(rules_of(validation.recipe).motions(validation.recipe))
            if row in shares
        ]
        panel = Panel("trajectories that are covered no better", "%", lines, include=(0.0, 100.0))
        axis = Axis("covered samples", "%")
        charts.append(Chart(title, [panel], axis, marks=[100 * USUAL_CONFIDENCE]))
    return charts


def ratio_chart(validation: Validation) -> Chart:
    """Draw the histogram of errors over their bounds, all outputs together.

    The axis is logarithmic; smaller ratios than ``SMALLEST_RATIO`` count in its first bar.
    """
    ratios = np.concatenate([error_over_bound(c).ravel() for c in validation.trusted])
    last = np.log10(max(float(ratios.max()), 1.0))
    first = np.log10(SMALLEST_RATIO)
    edges = 10 ** np.arange(first, last + RATIO_BAR, RATIO_BAR)
    counts, _ = np.histogram(np.clip(ratios, edges[0], edges[-1]), edges)
    share = 100 * np.repeat(counts / len(ratios), 2)
    x = np.repeat(edges, 2)[1:-1]
    covered = np.repeat(edges[1:] < 1 + 1e-9, 2)
    under, above = (np.where(some, share, np.nan) for some in (covered, ~covered))
    zero = np.zeros_like(share)
    bands = [Band("covered", x, zero, under, "line"), Band("not covered", x, zero, above, "bad")]
    panel = Panel("samples in each bar", "%", (), bands, include=(0.0,))
    title = f"Error over its bound: {percent(float(np.mean(ratios <= 1)))} of the samples covered"
    return Chart(title, [panel], Axis("|error| over its bound", log=True), marks=[1.0])


def search_chart(title: str, inputs: MeasuredInputs, surrogate: Surrogate) -> Chart:
    """Draw the inputs before the worst step, the errors, and their bounds."""
    first = max(inputs.first, inputs.step - BEFORE_WORST)
    shown = slice(first, inputs.step + BEFORE_WORST // 4)
    count = len(inputs.inputs[shown])
    time = surrogate.window.step * np.arange(first, first + count, dtype=np.float64)
    output = int(np.argmax((inputs.errors / inputs.bounds)[inputs.step]))
    error, bound = inputs.errors[shown, output], inputs.bounds[shown, output]
    signal = surrogate.outputs[output]
    panels = [
        signals_panel(surrogate.inputs, time, inputs.inputs[shown]),
        Panel(
            f"error of {signal.name}",
            signal.unit,
            [Line("|error|", time, error, "bad")],
            [Band("error bound", time, np.zeros_like(bound), bound)],
            include=(0.0,),
        ),
    ]
    return Chart(
        f"{title}: error {ratio_text(inputs.ratio)} times its bound",
        panels,
        parts=parts_of(~inputs.trusted[shown], time),
        marks=[surrogate.window.step * inputs.step],
        shaded=NOT_TRUSTED,
    )


def cumulative_shares(
    values: Sequence[float], ends: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Return finite values between two ends, and the share in % of all up to each place.

    Drawn as steps, the share of the values that are no larger is read at each place.
    """
    places = np.sort([value for value in values if np.isfinite(value)])
    share = 100 * np.arange(len(places) + 1, dtype=np.float64) / max(1, len(values))
    return np.array([ends[0], *places, ends[1]]), np.array([0.0, *share])


def _points(name: str, x: FloatArray, y: FloatArray, colour: str) -> Line:
    return Line(name, x, y, colour, "points", width=1.3)


def _diagonal(name: str, ends: FloatArray) -> Line:
    return Line(name, ends, ends, "cursor", width=1.0)


def _inside_and_outside(x: FloatArray, y: FloatArray, inside: NDArray[np.bool_]) -> Sequence[Line]:
    """Return points, those outside of the domain in a colour of their own.

    Those outside are few, so that they are thinned out by themselves.
    """
    parts = (("in the domain", inside, "line"), ("outside of the domain", ~inside, "bad"))
    chosen = [(name, _thinned(where), colour) for name, where, colour in parts]
    return [_points(name, x[some], y[some], colour) for name, some, colour in chosen if len(some)]


def _thinned(where: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the places that are drawn, a part of the given ones."""
    known = np.flatnonzero(where)
    return known[:: max(1, len(known) // SCATTER_POINTS)]


def _drawn(values: FloatArray) -> FloatArray:
    """Return values, (N,), kept from zero, so that the rest of a logarithmic axis is seen."""
    return np.maximum(values, max(SMALLEST_SHOWN * float(np.median(values)), TINY))
