"""Sections of a report show what error estimates and error bounds are worth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slide_fmu.report import trust_charts
from slide_fmu.report.report import Section
from slide_fmu.report.trust_pictures import coverage_by_kind
from slide_fmu.report.trust_sentences import COLUMNS, HARM, bound_sentences
from slide_fmu.report.trust_tables import bound_rows, estimate_rows, harm_rows, kind_rows
from slide_fmu.validation.comparison import Validation


def estimate_section(validations: Mapping[str, Validation]) -> Section:
    """Return the section on the error estimate, of a surrogate that has one."""
    first = next(iter(validations.values()))
    text = (
        "The FMU estimates the RMSE of its outputs over the last "
        f"{first.surrogate.estimated_samples} samples. Here it is compared with the true "
        "error; the band holds deviations up to 37.5 %. "
        "The estimate of every output stands beside the best constant: the "
        "one number whose mean relative deviation from the true errors is least. An estimate that "
        "does no better says nothing of a single span. Then follows how often and how far it was "
        "too small. The rank correlation is that of estimated and true errors."
    )
    rows = estimate_rows({name: v.figures() for name, v in validations.items()})
    return Section("Error estimate", text, rows, charts=trust_charts.estimate_charts(validations))


def bound_sections(validations: Mapping[str, Validation]) -> list[Section]:
    """Return the sections on error bound and domain, of a surrogate that has them."""
    first = next(iter(validations.values()))
    found = {name: v.figures() for name, v in validations.items()}
    moving = first.surrogate.hold == "first_order"
    in_range = next(filter(_is_in_range, found.values()), None)
    text = " ".join(bound_sentences(first.recipe, moving, in_range))
    return [
        Section(
            "Error bound",
            f"{text} {COLUMNS}",
            bound_rows(found),
            charts=[
                *trust_charts.bound_charts(validations),
                *trust_charts.novelty_charts(validations),
            ],
        ),
        Section(
            "Error bound by kind of excitation",
            "The bound is calibrated on the mix of all kinds, so that a rare one may be covered "
            "less. Shares are those of the output that is covered least.",
            kind_rows(found),
            [coverage_by_kind(validations)],
        ),
        *_harm_section(found),
    ]


def _is_in_range(figures: Mapping[str, Any]) -> bool:
    """Whether trajectories are like those of the calibration, so that flags are false alarms."""
    return bool(figures["amplitude"] == [1.0, 1.0] and not figures.get("held_out", False))


def _harm_section(found: Mapping[str, Any]) -> list[Section]:
    """Return the section on harmful errors, where the usual error is known."""
    rows = harm_rows(found)
    return [Section("Harmful errors", HARM, rows)] if len(rows) > 1 else []
