"""Tables of how far error estimates and bounds can be trusted, as rows of text.

Report, model card and console show the same figures, live or as an FMU keeps them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from slide_fmu.core.measures import percent

Figures = Mapping[str, Any]
"""The figures of one validation."""

OF_HARM = "harmful", "harmful_flagged", "harmless_flagged", "harmful_unnoticed"
"""Figures of harmful errors (``slide_fmu.validation.trust.harm_figures``)."""

OF_ESTIMATES = (
    *("mean", "p95", "constant_mean", "constant_p95"),
    *("too_small_share", "too_small_factor", "rank_correlation"),
)
"""Figures of an error estimate (``slide_fmu.validation.trust.estimate_figures``)."""


def estimates_of(figures: Figures) -> list[tuple[str, Figures]]:
    """Return what of estimates was measured, with its name.

    That is every output, and the norm of those that have one unit.
    """
    found = figures.get("error_estimate") or {}
    named = [(output["name"], output) for output in found.get("without_floor", [])]
    if "euclidean" in found:
        named.append(("norm of the outputs", found["euclidean"]))
    return named


def estimate_rows(validations: Mapping[str, Figures]) -> list[Sequence[str]]:
    """Return a table of the deviations of error estimates, its heading first."""
    rows: list[Sequence[str]] = [
        (
            "inputs",
            "output",
            "error estimate: mean relative deviation",
            "95 % within",
            "the best constant: mean",
            "95 % within",
            "error more than twice the estimate",
            "95 % of the errors below",
            "rank correlation",
        )
    ]
    for name, validation in validations.items():
        rows += [(name, *estimate_cells(*one)) for one in estimates_of(validation)]
    return rows


def estimate_cells(name: str, figures: Figures) -> Sequence[str]:
    """Return name, deviations, those of the constant, how often and how far it was too small."""
    return (
        name,
        *(percent(figures[key]) for key in OF_ESTIMATES[:5]),
        f"{figures['too_small_factor']:.3g} times the estimate",
        _correlation(figures["rank_correlation"]),
    )


def bound_rows(validations: Mapping[str, Figures]) -> list[Sequence[str]]:
    """Return a table of what error bounds and domain are worth, its heading first."""
    rows: list[Sequence[str]] = [
        (
            "inputs",
            "output",
            "covered samples",
            "of the 5 % worst trajectories",
            "width",
            "skill",
            "rank correlation",
            "samples outside of the domain",
            "trajectories outside",
        )
    ]
    for name, validation in validations.items():
        bound = validation["error_bound"]
        for output in bound["outputs"]:
            rows.append((name, *output_cells(output), *_outside(bound)))
    return rows


def output_cells(output: Figures) -> Sequence[str]:
    """Return name, coverage, that of the worst trajectories, width, skill, rank correlation."""
    return (
        output["name"],
        percent(output["coverage"]),
        percent(output["coverage_of_worst_trajectories"]),
        "" if output["width"] is None else f"{output['width']:.3g}",
        "" if output["skill"] is None else percent(output["skill"]),
        _correlation(output["rank_correlation"]),
    )


def kind_rows(validations: Mapping[str, Figures]) -> list[Sequence[str]]:
    """Return a table of bounds by kind of excitation, its heading first.

    The covered shares are those of the output with the least.
    """
    rows: list[Sequence[str]] = [
        (
            "inputs",
            "excitation",
            "trajectories",
            "covered samples, mean",
            "lowest of a trajectory",
            "samples outside of the domain",
        )
    ]
    for name, validation in validations.items():
        for kind in validation["error_bound"]["excitations"]:
            rows.append(
                (
                    name,
                    kind["name"],
                    str(kind["trajectories"]),
                    percent(min(kind["coverage"])),
                    percent(min(kind["lowest_coverage"])),
                    percent(kind["flagged"]),
                )
            )
    return rows


def harm_rows(validations: Mapping[str, Figures]) -> list[Sequence[str]]:
    """Return a table of harmful errors and what the FMU says there, its heading first.

    It has no rows of validations that know no usual error.
    """
    rows: list[Sequence[str]] = [
        (
            "inputs",
            "excitation",
            "harmful samples",
            "of them outside of the domain",
            "of the harmless ones",
            "harmful, in the domain and above the bound",
        )
    ]
    for name, validation in validations.items():
        bound = validation["error_bound"]
        for kind in ({"name": "all", **bound}, *bound["excitations"]):
            if "harm" in kind:
                rows.append((name, kind["name"], *_harm_cells(kind["harm"])))
    return rows


def _harm_cells(harm: Figures) -> list[str]:
    return ["" if harm[key] is None else percent(harm[key]) for key in OF_HARM]


def _outside(bound: Figures) -> Sequence[str]:
    return percent(bound["flagged"]), percent(bound["trajectories_flagged"])


def _correlation(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
