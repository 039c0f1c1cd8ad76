"""This module makes the sections of a report on error estimates, bounds and tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import quantity, ratio_text
from slide_fmu.core.units import NO_UNIT
from slide_fmu.report import trust_charts
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.limits import bound_sentences
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.description import SurrogateDescription
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
    "more errors and give more alarms. The FMU starts with the tolerances of the first row, which "
    "come from its calibration. The other rows have those with which this share of the samples "
    "measured here in range would be flagged; domain and ranges are included. Set them by the "
    "parameters <output>_error_tolerance."
)
"""Explanation of ``tolerance_table``."""

AT_START = "as the FMU starts"
"""The row of the tolerances that an FMU has before a user sets them."""


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
    validations: Mapping[str, Validation], figures: Validations, surrogate: SurrogateDescription
) -> list[ReportSection]:
    """Return the sections on error bound and tolerances, of a surrogate that has them."""
    first = next(iter(validations.values()))
    tolerances = tolerance_table(figures, surrogate)
    return [
        ReportSection(
            "Error bound",
            " ".join(bound_sentences(surrogate, first.recipe)),
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
    worst = max(attacks, key=lambda attack: attack.after, default=None)
    if worst is None:
        return []
    before = max(attack.before for attack in attacks)
    text = (
        f"A search changed the inputs of {len(attacks)} unseen trajectories within their ranges, "
        "so that an error becomes large relative to its bound while trusted is true. Before the "
        f"search the largest ratio was {ratio_text(before)}."
    )
    charts = [trust_charts.search_chart("The worst start", worst.measured, surrogate)]
    return [ReportSection("Search for unnoticed errors", text, charts=charts)]


def deviations_of(figures: EstimateFigures | None) -> list[tuple[str, Deviation]]:
    """Return the deviations of every output and of their norm, each with its name.

    Those of planned motions in the plain call come behind.
    """
    if figures is None:
        return []
    every = [*figures.without_floor, *([] if figures.euclidean is None else [figures.euclidean])]
    plain = [(f"{one.name}, plain call", one) for one in figures.plain]
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


def _estimate_cells(name: str, deviation: Deviation) -> Sequence[str]:
    correlation = deviation.rank_correlation
    return (
        name,
        percent(deviation.mean),
        percent(deviation.p95),
        percent(deviation.constant_mean),
        percent(deviation.constant_p95),
        percent(deviation.too_small_share),
        f"{ratio_text(deviation.too_small_factor)} times the estimate",
        "" if correlation is None else f"{correlation:.2f}",
    )


def tolerance_table(validations: Validations, surrogate: SurrogateDescription) -> ReportTable:
    """Return the tolerances of all outputs: those of the start, and by the share of false alarms.

    The table is empty where no validation has tolerances by false alarms.
    """
    in_range = next((one for one in validations.values() if one.tolerances), None)
    if in_range is None:
        return ReportTable.of((), ())
    outputs = in_range.outputs

    def rows() -> Iterator[tuple[str, ...]]:
        yield (AT_START, *(size for size, _ in surrogate.tolerances))
        for row in in_range.tolerances:
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
