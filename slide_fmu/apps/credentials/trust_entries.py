"""Credentials have tables of error bounds, and of error estimates compared with a constant."""

from __future__ import annotations

from collections.abc import Iterator

from slide_fmu.apps.credentials.metadata import Entry, Row, table
from slide_fmu.report.trust_tables import Validations, deviations_of, harms_of
from slide_fmu.validation.trust_figures import DomainFigures


def trust_entries(validations: Validations) -> list[Entry]:
    """Return the tables of the figures that validations have."""
    found = [
        table("error_estimate", "Deviation", _estimates(validations)),
        table("error_bound", "Bound", _bounds(validations)),
        table("error_bound.excitations", "Excitation", _kinds(validations)),
        table("error_bound.harm", "Harm", _harm(validations)),
    ]
    return [entry for entry in found if len(entry.value)]


def _estimates(validations: Validations) -> Iterator[Row]:
    for name, validation in validations.items():
        for output, found in deviations_of(validation.error_estimate):
            assert validation.error_estimate is not None
            span = validation.error_estimate.span_samples
            of_output = {"inputs": name, "output": output, "span_samples": span}
            yield {**of_output, **{key: v for key, v in vars(found).items() if key != "name"}}


def _bounds(validations: Validations) -> Iterator[Row]:
    for name, validation in validations.items():
        bound = validation.error_bound
        for output in () if bound is None else bound.outputs:
            assert bound is not None
            worth = {key: value for key, value in vars(output).items() if key != "name"}
            of_output = {"inputs": name, "output": output.name, "confidence": bound.confidence}
            yield {**of_output, **worth, **_domain(bound)}


def _harm(validations: Validations) -> Iterator[Row]:
    """Yield a row for each kind of excitation, and one for all of them."""
    for name, validation in validations.items():
        if validation.error_bound is not None:
            for kind, harm in harms_of(validation.error_bound):
                yield {"inputs": name, "name": kind, **vars(harm)}


def _kinds(validations: Validations) -> Iterator[Row]:
    """Yield a row for each kind and output."""
    for name, validation in validations.items():
        bound = validation.error_bound
        for kind in () if bound is None else bound.excitations:
            shares = zip(kind.coverage, kind.lowest_coverage, strict=True)
            for output, (mean, lowest) in zip(validation.outputs, shares, strict=True):
                yield {
                    "inputs": name,
                    "name": kind.name,
                    "output": output.name,
                    "trajectories": kind.trajectories,
                    "coverage": mean,
                    "lowest_coverage": lowest,
                    **_domain(kind),
                }


def _domain(found: DomainFigures) -> Row:
    return {
        "flagged": found.flagged,
        "trajectories_flagged": found.trajectories_flagged,
        "untrusted": found.untrusted,
    }
