"""Charts of how far error estimates and error bounds hold, over all samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import percent, rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.web.charts import Axis, Band, Chart, Line, Panel
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.validation.comparison import Validation
from slide_fmu.validation.trust import TINY
from slide_fmu.validation.worst_steps import error_over_bound

SCATTER_POINTS = 3000
"""A panel has no more points than about these; further ones would hide behind them."""

SMALLEST_SHOWN = 1e-3
"""Errors below this part of their median are drawn at this part: they hit zero by chance."""

BAND = 0.375
"""The band about the diagonal holds relative deviations of an estimate up to this."""


def estimate_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw estimated over true errors, a chart per validation, where some are positive."""
    found = []
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
        found.append(Chart(title, [panel], Axis(label, unit, log=True)))
    return found


def bound_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw bounds over absolute errors, a chart per validation; covered points lie above a line.

    Both are relative to the RMS about its mean of the outputs' reference in the first validation.
    """
    main = next(iter(validations.values()))
    scale = rms(np.concatenate([c.reference - main.mean for c in main.trusted])) + TINY
    found = []
    for title, validation in validations.items():
        error, bound, inside = [], [], []
        for c in validation.trusted:
            assert c.told is not None
            error.append((np.abs(c.error) / scale).ravel())
            bound.append((c.told.bounds / scale).ravel())
            inside.append(np.repeat(c.told.in_domain == 1, c.error.shape[1]))
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
        found.append(Chart(f"{title}: above the line, the bound holds", [panel], axis))
    return found


def novelty_charts(validations: Mapping[str, Validation]) -> list[Chart]:
    """Draw errors over their bounds, the worst output's, over the novelty of the inputs."""
    found = []
    for title, validation in validations.items():
        told = [c.told for c in validation.trusted if c.told is not None]
        novelty = np.maximum(np.concatenate([one.novelty for one in told]), TINY)
        inside = np.concatenate([one.in_domain == 1 for one in told])
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
        found.append(Chart(heading, [panel], Axis("novelty", log=True)))
    return found


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
    """Return the places that are drawn, of those where something is."""
    known = np.flatnonzero(where)
    return known[:: max(1, len(known) // SCATTER_POINTS)]


def _drawn(values: FloatArray) -> FloatArray:
    """Return values, (N,), kept from zero, so that the rest of a logarithmic axis is seen."""
    return np.maximum(values, max(SMALLEST_SHOWN * float(np.median(values)), TINY))
