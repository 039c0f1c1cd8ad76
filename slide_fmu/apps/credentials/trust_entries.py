"""What credentials say of error bounds, and of error estimates beside a constant, as tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from slide_fmu.apps.credentials.metadata import Entry, Row, table
from slide_fmu.report.trust_tables import OF_ESTIMATES, Figures, estimates_of

OF_BOUNDS = (
    *("coverage", "coverage_of_worst_trajectories", "width", "skill"),
    "rank_correlation",
)
"""Figures of the bound of an output."""

OF_DOMAINS = "flagged", "trajectories_flagged"


def trust_entries(validations: Mapping[str, Figures]) -> list[Entry]:
    """Return the tables of the figures that validations have."""
    found = [
        table("error_estimate", "Deviation", _estimates(validations)),
        table("error_bound", "Bound", _bounds(validations)),
        table("error_bound.excitations", "Excitation", _kinds(validations)),
        table("error_bound.harm", "Harm", _harm(validations)),
    ]
    return [entry for entry in found if len(entry.value)]


def _estimates(validations: Mapping[str, Figures]) -> Iterator[Row]:
    for name, validation in validations.items():
        for output, figures in estimates_of(validation):
            span = validation["error_estimate"]["span_samples"]
            of_output = {"inputs": name, "output": output, "span_samples": span}
            yield {**of_output, **{key: figures[key] for key in OF_ESTIMATES}}


def _bounds(validations: Mapping[str, Figures]) -> Iterator[Row]:
    for name, validation in validations.items():
        bound = validation.get("error_bound", {"outputs": []})
        for output in bound["outputs"]:
            yield {
                "inputs": name,
                "output": output["name"],
                "confidence": bound["confidence"],
                **{key: output[key] for key in OF_BOUNDS},
                **{key: bound[key] for key in OF_DOMAINS},
            }


def _harm(validations: Mapping[str, Figures]) -> Iterator[Row]:
    """Give a row for each kind of excitation, and one for all of them."""
    for name, validation in validations.items():
        bound = validation.get("error_bound", {"excitations": []})
        for kind in ({"name": "all", **bound}, *bound["excitations"]):
            if "harm" in kind:
                yield {"inputs": name, "name": kind["name"], **kind["harm"]}


def _kinds(validations: Mapping[str, Figures]) -> Iterator[Row]:
    """Give a row for each kind and output."""
    for name, validation in validations.items():
        for kind in validation.get("error_bound", {"excitations": []})["excitations"]:
            shares = zip(kind["coverage"], kind["lowest_coverage"], strict=True)
            for output, (mean, lowest) in zip(validation["outputs"], shares, strict=True):
                yield {
                    "inputs": name,
                    "name": kind["name"],
                    "output": output["name"],
                    "trajectories": kind["trajectories"],
                    "coverage": mean,
                    "lowest_coverage": lowest,
                    **{key: kind[key] for key in OF_DOMAINS},
                }
