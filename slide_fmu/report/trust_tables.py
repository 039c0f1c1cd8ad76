"""This module makes tables on the quality of error estimates and bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import quantity, ratio_text
from slide_fmu.core.units import NO_UNIT
from slide_fmu.report.error_tables import percent_or_nothing
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import Deviation, EstimateFigures, ValidationFigures
from slide_fmu.validation.trust import BROKEN
from slide_fmu.validation.trust_figures import (
    BoundFigures,
    Covered,
    Harm,
    KindBound,
    OutputBound,
    SearchFigures,
    TryFigures,
)

Validations = Mapping[str, ValidationFigures]

OF_AN_ESTIMATE = (
    "95 % within",
    "the best constant: mean",
    "the best constant: 95 % within",
    "error more than twice the estimate",
    "95 % of the errors below",
    "rank correlation",
)
"""Columns of an error estimate behind its mean deviation."""

NORM = "norm of the outputs"


def deviations_of(found: EstimateFigures | None) -> list[tuple[str, Deviation]]:
    """Return the deviations of every output and of their norm, each with its name.

    Those of planned motions in the plain call come behind.
    """
    if found is None:
        return []
    every = [*found.without_floor, *([] if found.euclidean is None else [found.euclidean])]
    plain = [(f"{one.name}, plain call", one) for one in found.plain]
    return [*((one.name or NORM, one) for one in every), *plain]


def estimate_table(validations: Validations) -> ReportTable:
    """Return the deviations of error estimates."""
    heading = "inputs", "output", "error estimate: mean relative deviation", *OF_AN_ESTIMATE
    rows = (
        (name, *_estimate_cells(*one))
        for name, validation in validations.items()
        for one in deviations_of(validation.error_estimate)
    )
    return ReportTable.of(heading, rows)


def short_estimate_table(found: EstimateFigures) -> ReportTable:
    """Return the deviations of the error estimates of one validation."""
    heading = "output", "mean relative deviation", *OF_AN_ESTIMATE
    rows = [_estimate_cells(*one) for one in deviations_of(found)]
    return ReportTable.of(heading, rows, f"error estimate over {found.span_samples} samples")


def _estimate_cells(name: str, found: Deviation) -> Sequence[str]:
    return (
        name,
        percent(found.mean),
        percent(found.p95),
        percent(found.constant_mean),
        percent(found.constant_p95),
        percent(found.too_small_share),
        f"{ratio_text(found.too_small_factor)} times the estimate",
        _correlation(found.rank_correlation),
    )


def bound_table(validations: Validations) -> ReportTable:
    """Return the measures of error bounds and domain."""
    heading = (
        "inputs",
        "output",
        "covered samples",
        "of the 5 % worst trajectories",
        "width",
        "skill",
        "rank correlation",
        "samples outside of the domain",
        "trajectories outside",
        "samples with trusted = false",
    )
    rows = (
        (
            name,
            *_bound_cells(output),
            percent(b.flagged),
            percent(b.trajectories_flagged),
            percent(b.untrusted),
        )
        for name, b in _bounds(validations)
        for output in b.outputs
    )
    return ReportTable.of(heading, rows)


def short_bound_table(bound: BoundFigures) -> ReportTable:
    """Return the measures of the error bounds of one validation."""
    heading = (
        "output",
        "covered samples",
        "of the 5 % worst trajectories",
        "mean bound / 95 % quantile of errors",
        "skill against the best constant",
        "rank correlation",
    )
    title = f"error bound, {100 * bound.confidence:g} % confidence"
    return ReportTable.of(heading, map(_bound_cells, bound.outputs), title)


def _bound_cells(output: OutputBound) -> Sequence[str]:
    return (
        output.name,
        percent(output.coverage),
        percent(output.coverage_of_worst_trajectories),
        "" if output.width is None else f"{output.width:.3g}",
        percent_or_nothing(output.skill),
        _correlation(output.rank_correlation),
    )


def kind_table(validations: Validations) -> ReportTable:
    """Return bounds by kind of excitation, with the smallest share of all outputs."""
    heading = (
        "inputs",
        "excitation",
        "trajectories",
        "covered samples, mean",
        "lowest of a trajectory",
        "samples outside of the domain",
        "samples with trusted = false",
    )
    rows = (
        (
            name,
            kind.name,
            str(kind.trajectories),
            percent(min(kind.coverage)),
            percent(min(kind.lowest_coverage)),
            percent(kind.flagged),
            percent(kind.untrusted),
        )
        for name, bound in _bounds(validations)
        for kind in bound.excitations
    )
    return ReportTable.of(heading, rows)


def harm_table(validations: Validations) -> ReportTable:
    """Return the shares of harmful errors, and of those that the FMU reports.

    Validations without a known usual error have no rows.
    """
    heading = (
        "inputs",
        "excitation",
        "harmful samples",
        "of them flagged (not trusted)",
        "of the harmless ones",
        "harmful, trusted and above the bound",
    )
    rows = (
        (name, kind, *map(percent_or_nothing, vars(harm).values()))
        for name, bound in _bounds(validations)
        for kind, harm in harms_of(bound)
    )
    return ReportTable.of(heading, rows)


def tolerance_table(validations: Validations) -> ReportTable:
    """Return the tolerances of all outputs by the share of false alarms."""
    found = [
        (validation.outputs, bound.tolerances)
        for validation in validations.values()
        if (bound := validation.error_bound) is not None and bound.tolerances
    ]
    if not found:
        return ReportTable.of((), ())
    outputs, tolerances = found[0]
    columns = (f"tolerance of {one.name}" for one in outputs)
    rows = (
        (
            percent(row.alarms),
            *(("not reached",) * len(outputs) if row.tolerances is None else ()),
            *(
                quantity(value, one.unit or NO_UNIT)
                for one, value in zip(outputs, row.tolerances or (), strict=False)
            ),
        )
        for row in tolerances
    )
    title = (
        "tolerances of 95 % error bounds, by the share of the samples of these trajectories with "
        "trusted = false; those of the start come from the calibration"
    )
    return ReportTable.of(("false alarms on these trajectories", *columns), rows, title)


def harms_of(bound: BoundFigures) -> list[tuple[str, Harm]]:
    """Return the harm of all errors and of each kind of excitation, by name, where known.

    That of planned motions in the plain call has a row of its own.
    """
    every: list[tuple[str, BoundFigures | KindBound | Covered]] = [("all", bound)]
    if bound.plain is not None and bound.plain.harm != bound.harm:
        every.append(("all, plain call", bound.plain))
    every += [(kind.name, kind) for kind in bound.excitations]
    return [(name, one.harm) for name, one in every if one.harm is not None]


def search_table(figures: SearchFigures) -> ReportTable:
    """Return the results of a search for unnoticed errors."""
    usual, highest = figures.confidences
    parts = (
        (figures.before, f"unseen trajectories, confidence {usual:g}"),
        (figures.after, f"after the search, confidence {usual:g}"),
        (figures.after_highest, f"after the search, confidence {highest:g}"),
    )
    rows = (
        (
            text,
            ratio_text(float(np.median(ratios))),
            ratio_text(max(ratios)),
            f"{sum(ratio > BROKEN for ratio in ratios)} of {len(ratios)}",
        )
        for ratios, text in parts
    )
    heading = "error over its bound, largest where trusted", "median", "worst", "broken"
    return ReportTable.of(heading, rows)


def tries_table(figures: SearchFigures) -> ReportTable:
    """Return the worst try of each kind of input as users set it, the worst kind first."""
    heading = (
        *("kind", "broken", "inputs", "error over its bound", "relative RMSE", "largest error"),
        *("harmful", "harmful and not reported"),
    )
    by_kind: dict[str, list[TryFigures]] = {}
    for one in figures.tries:
        by_kind.setdefault(one.kind, []).append(one)
    rows = (
        (
            kind,
            f"{sum(one.over_bound > BROKEN for one in tries)} of {len(tries)}",
            tries[0].inputs,
            ratio_text(tries[0].over_bound),
            "" if tries[0].relative_rmse is None else percent(tries[0].relative_rmse),
            f"{tries[0].output}: {quantity(tries[0].largest_error, tries[0].unit)}",
            *(percent(share) for share in (tries[0].harmful, tries[0].unnoticed)),
        )
        for kind, tries in by_kind.items()
    )
    return ReportTable.of(heading, rows)


def _bounds(validations: Validations) -> list[tuple[str, BoundFigures]]:
    """Return the figures of bounds by validation; validations without bounds are left out."""
    found = ((name, validation.error_bound) for name, validation in validations.items())
    return [(name, bound) for name, bound in found if bound is not None]


def _correlation(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
