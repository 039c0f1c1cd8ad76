"""The figures of a run: ``report.json`` holds their dump; an FMU, one without times."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from slide_fmu.core.figures import optional, plain, read_figures
from slide_fmu.fitting.history import Curve, SizeTrial
from slide_fmu.fmu.export import Provenance
from slide_fmu.memory.decay_figures import SizingFigures
from slide_fmu.memory.stability import StabilityFigures
from slide_fmu.validation.error_figures import (
    LoopFigures,
    ResponseFigures,
    ValidationFigures,
)
from slide_fmu.validation.row import Row


@dataclass(frozen=True, kw_only=True)
class RunFigures:
    """These are the figures of a run.

    Attributes:
        name: name of the surrogate.
        command: the command that the user called.
        versions: of the packages that made it, by name.
        validation: figures by the name of the validation, the first one in range.
        window: memory of the system, and the part that the window truncates.
        parameters: number of the network's parameters.
        response_matrix: of affine surrogates.
        stability: tests of networks that have a state.
        no_error_estimate: why there is no error estimate, although the recipe asks for one.
        sizes_tried: sizes that a search has tried; None without a known training.
        explanations: one sentence for each choice of features, hidden units or sizes, on why it
            pays; empty without a search.
        remark: remarks on training and error.
        record_remarks: remarks on records.
        rows: all inputs that were measured, in all calls and at all communication steps.
        loops: how errors grow in the loops of the recipe.
    """

    name: str
    command: str
    versions: Mapping[str, str]
    validation: Mapping[str, ValidationFigures]
    window: SizingFigures
    parameters: int
    response_matrix: ResponseFigures | None = optional()
    stability: tuple[StabilityFigures, ...] = optional(())
    no_error_estimate: str | None = optional()
    sizes_tried: tuple[SizeTrial, ...] | None = optional()
    explanations: tuple[str, ...] = optional(())
    remark: str | None = None
    learning_curve: Curve | None = optional()
    record_remarks: tuple[str, ...] | None = optional()
    rows: tuple[Row, ...] = optional(())
    loops: tuple[LoopFigures, ...] = optional(())

    def dump(self) -> Any:
        """Return the figures as plain values; figures of an unknown training are left out."""
        values = plain(self)
        if self.sizes_tried is None:
            del values["remark"]
        return values

    def without_times(self) -> RunFigures:
        """Return the figures without times, which are others in each run.

        An FMU holds these figures, so that the same recipe gives the same file.
        """
        untimed = {name: replace(one, timing=None) for name, one in self.validation.items()}
        return replace(self, validation=untimed)

    @property
    def ordered(self) -> dict[str, ValidationFigures]:
        """The validations by name, those of small amplitudes first.

        An FMU keeps its figures with sorted keys, in which "beyond the range" comes first.
        """
        named = self.validation.items()
        return dict(sorted(named, key=lambda item: item[1].amplitude[1]))

    @property
    def in_range(self) -> ValidationFigures:
        """The validation in range, or of the smallest amplitudes."""
        validations = self.ordered.values()
        return next((each for each in validations if each.in_range), next(iter(validations)))

    @property
    def remarks(self) -> tuple[str, ...]:
        """The remarks on records, on training and on the error."""
        own = () if self.remark is None else (self.remark,)
        return (*(self.record_remarks or ()), *own)

    @property
    def usual_error(self) -> float:
        """The RMS error in range with known inputs, as a norm over the outputs."""
        return math.hypot(*(output.rmse for output in self.in_range.outputs))


def released_figures(provenance: Provenance | None) -> RunFigures | None:
    """Return the figures in an FMU; None where it was not measured.

    Raises:
        ValueError: the figures are not of the form that this version writes.
    """
    measured = (provenance or {}).get("measured")
    if measured is None:
        return None
    try:
        figures = read_figures(RunFigures, measured)
    except ValidationError as error:
        first, *others = error.errors()
        place, more = ".".join(map(str, first["loc"])), f" and {len(others)} more" * bool(others)
        raise ValueError(_other_form(f"{place}{more}: {first['msg']}")) from error
    if not figures.validation:
        raise ValueError(_other_form("validation: it is empty"))
    return figures


def _other_form(what: str) -> str:
    return (
        f"measured figures in the FMU: {what}; expected those that this version of slide-fmu "
        "writes: make the FMU anew (slide-fmu run)"
    )
