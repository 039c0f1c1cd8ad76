"""This module makes the sections of a report on error estimates and bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slide_fmu.report import trust_charts
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.trust_sentences import (
    COLUMNS,
    HARM,
    TOLERANCES,
    bound_sentences,
    tries_sentences,
)
from slide_fmu.report.trust_tables import (
    bound_table,
    estimate_table,
    harm_table,
    kind_table,
    search_table,
    tolerance_table,
    tries_table,
)
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.adversarial import Attack
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.tries import TriedInputs
from slide_fmu.validation.trust import BROKEN
from slide_fmu.validation.trust_figures import SearchFigures


def estimate_section(
    validations: Mapping[str, Validation], figures: Mapping[str, ValidationFigures]
) -> ReportSection:
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
    validations: Mapping[str, Validation], figures: Mapping[str, ValidationFigures]
) -> list[ReportSection]:
    """Return the sections on error bound and domain, of a surrogate that has them."""
    first = next(iter(validations.values()))
    in_range = next((found for found in figures.values() if found.in_range), None)
    harm, tolerances = harm_table(figures), tolerance_table(figures)
    sentences = bound_sentences(first.recipe, first.surrogate, in_range)
    return [
        ReportSection(
            "Error bound",
            "\n\n".join((*sentences, COLUMNS)),
            bound_table(figures),
            charts=[
                *trust_charts.bound_charts(validations),
                *trust_charts.novelty_charts(validations),
            ],
        ),
        ReportSection(
            "Error bound by kind of excitation",
            "The bound is calibrated on the mix of all kinds, so that a rare one may be covered "
            "less. Shares are given for the output that is covered least. The charts show the "
            "part of the trajectories of a kind with at most a share of covered samples; the "
            "dotted line is the confidence.",
            kind_table(figures),
            charts=trust_charts.coverage_charts(validations),
        ),
        *([ReportSection("Harmful errors", HARM, harm)] if harm.rows else []),
        *([ReportSection("Tolerances", TOLERANCES, tolerances)] if tolerances.rows else []),
    ]


def search_sections(
    figures: SearchFigures, attacks: Sequence[Attack], tried: TriedInputs, surrogate: Surrogate
) -> list[ReportSection]:
    """Show the figures of a search and of its tries, and their worst results, if known."""
    text = (
        f"A search changes the inputs of {figures.starts} unseen trajectories within their "
        f"ranges ({figures.changes_tried} changes are tried of each) so that an error becomes "
        "large relative to its bound while trusted is true. With a bound of 95 % one step "
        "in twenty has a larger error anyway; a bound counts as broken where the error is more "
        f"than {BROKEN:g} times as large."
    )
    worst = max(attacks, key=lambda found: found.after, default=None)
    charts = []
    if worst is not None:
        charts = [trust_charts.search_chart("The worst start", worst.found, surrogate)]
    return [
        ReportSection("Search for unnoticed errors", text, search_table(figures), charts=charts),
        *_tries_sections(figures, tried, surrogate),
    ]


def _tries_sections(
    figures: SearchFigures, tried: TriedInputs, surrogate: Surrogate
) -> list[ReportSection]:
    if not figures.tries:
        return []
    text = (
        f"{' '.join(tries_sentences(figures))} Half of the tries were drawn, half lie near the "
        "worst ones. The table has the worst of each kind; its last columns are shares of all "
        "samples. Times t are in s, from rest on. Train on inputs like the worst."
    )
    charts = [
        trust_charts.search_chart("The worst try", worst.found, surrogate)
        for worst in tried.worst_first[:1]
    ]
    return [ReportSection("Inputs as users set them", text, tries_table(figures), charts=charts)]
