"""This module makes the sections of a report on error estimates, bounds and tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import quantity, ratio_text
from slide_fmu.core.units import NO_UNIT
from slide_fmu.recipe.recipe import FURTHER, Recipe
from slide_fmu.report import trust_charts
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.error_bound import calibrated
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.adversarial import Attack
from slide_fmu.validation.error_figures import Deviation, EstimateFigures, ValidationFigures
from slide_fmu.validation.results import Validation

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

TOLERANCES = (
    "The flag trusted is false where a 95 % bound exceeds its tolerance. Smaller tolerances find "
    "more errors and give more alarms. A row has the tolerances with which this share of the "
    "samples in range is flagged; domain and ranges are included. Set them by the parameters "
    "<output>_error_tolerance; those of the start come from the calibration."
)
"""Explanation of ``tolerance_table``."""


def estimate_section(validations: Mapping[str, Validation], figures: Validations) -> ReportSection:
    """Return the section on the error estimate, of a surrogate that has one."""
    first = next(iter(validations.values()))
    text = (
        "The FMU estimates the RMSE of its outputs over the last "
        f"{first.surrogate.estimated_samples} samples. Here it is compared with the true "
        "error; the band holds deviations up to 37.5 %. "
        "The estimate of every output is compared with the best constant: the "
        "one number whose mean relative deviation from the true errors is least. An estimate that "
        "does no better says nothing of a single span. Then follows how often and how far it was "
        "too small. The rank correlation is between estimated and true errors."
    )
    charts = trust_charts.estimate_charts(validations)
    return ReportSection("Error estimate", text, estimate_table(figures), charts=charts)


def bound_sections(
    validations: Mapping[str, Validation], figures: Validations
) -> list[ReportSection]:
    """Return the sections on error bound and tolerances, of a surrogate that has them."""
    first = next(iter(validations.values()))
    tolerances = tolerance_table(figures)
    return [
        ReportSection(
            "Error bound",
            " ".join(bound_sentences(first.recipe, first.surrogate)),
            charts=[
                *([trust_charts.ratio_chart(first)] if first.trusted else []),
                *trust_charts.bound_charts(validations),
                *trust_charts.novelty_charts(validations),
                *trust_charts.coverage_charts(validations),
            ],
        ),
        *([ReportSection("Tolerances", TOLERANCES, tolerances)] if tolerances.rows else []),
    ]


def search_sections(attacks: Sequence[Attack], surrogate: Surrogate) -> list[ReportSection]:
    """Show the worst result of a search for unnoticed errors, if one was done now."""
    worst = max(attacks, key=lambda found: found.after, default=None)
    if worst is None:
        return []
    before = max(found.before for found in attacks)
    text = (
        f"A search changed the inputs of {len(attacks)} unseen trajectories within their ranges, "
        "so that an error becomes large relative to its bound while trusted is true. Before the "
        f"search the largest ratio was {ratio_text(before)}."
    )
    charts = [trust_charts.search_chart("The worst start", worst.found, surrogate)]
    return [ReportSection("Search for unnoticed errors", text, charts=charts)]


def bound_sentences(recipe: Recipe, surrogate: Surrogate) -> list[str]:
    """Say where bounds count, and how the FMU reports that they do not.

    Args:
        recipe: the recipe of the FMU; it has the table ``bound``.
        surrogate: the surrogate of the FMU.
    """
    assert recipe.bound is not None
    low, *_, high = (f"{100 * c:g}" for c in calibrated(recipe.count("calibration")))
    found = [
        "Error bounds count for inputs of the kinds that the surrogate was trained on: they were "
        f"calibrated by {recipe.count('calibration')} trajectories of the same mix.",
        "There, at least this share of the samples has an error below the bound, averaged over "
        f"trajectories: the confidence, {low} to {high} %. A single trajectory, a single kind, or "
        "the samples with the largest errors may be covered less.",
        "Where in_domain is false, the bound is not calibrated, and may be far too small: inputs "
        "have left their ranges, or the surrogate and its companion are further apart, or move "
        "more, than is usual on the calibration.",
        "For inputs of other kinds, in_domain = true proves nothing.",
    ]
    if recipe.further_kinds():
        found.append(
            f"Bounds have also learnt from {recipe.count(FURTHER)} trajectories of further kinds "
            "of inputs; nothing was calibrated by them."
        )
    if recipe.system.reference:
        found.append(
            "Error bounds were calibrated against the model that made the data: the error of that "
            "model against the finer reference is not in them."
        )
    wanted, of_domain = percent(recipe.bound.false_alarms), percent(recipe.bound.domain_alarms)
    return [
        *found,
        "Where trusted is false, a step may be wrong: a 95 % bound exceeds its tolerance, "
        "in_domain or a range is false, or error_bound_filled is below 1. Tolerances are "
        "parameters, one of each output; with those of the start, trusted was false for at most "
        f"{wanted} of the samples of the calibration, and in_domain for {of_domain}.",
    ]


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


def _estimate_cells(name: str, found: Deviation) -> Sequence[str]:
    correlation = found.rank_correlation
    return (
        name,
        percent(found.mean),
        percent(found.p95),
        percent(found.constant_mean),
        percent(found.constant_p95),
        percent(found.too_small_share),
        f"{ratio_text(found.too_small_factor)} times the estimate",
        "" if correlation is None else f"{correlation:.2f}",
    )


def tolerance_table(validations: Validations) -> ReportTable:
    """Return the tolerances of all outputs by the share of false alarms."""
    found = next((one for one in validations.values() if one.tolerances), None)
    if found is None:
        return ReportTable.of((), ())
    outputs = found.outputs

    def rows() -> Iterator[tuple[str, ...]]:
        for row in found.tolerances:
            if row.tolerances is None:
                yield (percent(row.alarms), *("not reached" for _ in outputs))
                continue
            pairs = zip(row.tolerances, outputs, strict=True)
            yield (
                percent(row.alarms),
                *(quantity(value, one.unit or NO_UNIT) for value, one in pairs),
            )

    columns = (f"tolerance of {one.name}" for one in outputs)
    return ReportTable.of(("false alarms on these trajectories", *columns), rows())
