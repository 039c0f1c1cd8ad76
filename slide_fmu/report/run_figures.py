"""The figures of a run: ``report.json`` and the provenance of an FMU hold their dump."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from slide_fmu.core.figures import optional, plain, read_figures
from slide_fmu.fitting.history import Curve, TriedSize
from slide_fmu.fmu.export import Provenance
from slide_fmu.memory.decay_figures import SizingFigures
from slide_fmu.memory.stability import StabilityFigures
from slide_fmu.validation.error_figures import (
    BoxFigures,
    PlainCallFigures,
    ResponseFigures,
    SearchFigures,
    ValidationFigures,
)


@dataclass(frozen=True, kw_only=True)
class RunFigures:
    """These are the figures of a run.

    Attributes:
        name: that of the surrogate.
        command: what the user called.
        versions: of the packages that made it, by name.
        validation: by what was measured, the first one in range.
        window: how the window holds the system.
        parameters: number of the network's parameters.
        response_matrix: of affine surrogates.
        stability: tests of networks that have a state.
        no_error_estimate: why there is no error estimate, although the recipe asks for one.
        sizes_tried: what a search for sizes has judged; None where nothing is known of the
            training.
        remark: what one should know about training and error.
        record_remarks: what one should know about records.
        plain_call, box, adversarial: what was measured in range besides.
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
    sizes_tried: tuple[TriedSize, ...] | None = optional()
    remark: str | None = None
    learning_curve: Curve | None = optional()
    record_remarks: tuple[str, ...] | None = optional()
    plain_call: PlainCallFigures | None = optional()
    box: BoxFigures | None = optional()
    adversarial: SearchFigures | None = optional()

    def dump(self) -> Any:
        """Return the figures as plain values; of a training of which nothing is known, none."""
        found = plain(self)
        if self.sizes_tried is None:
            del found["remark"]
        return found

    @property
    def ordered(self) -> dict[str, ValidationFigures]:
        """The validations by name, those of small amplitudes first.

        An FMU keeps its figures with sorted keys, in which "beyond the range" comes first.
        """
        found = self.validation.items()
        return dict(sorted(found, key=lambda item: item[1].amplitude[1]))

    @property
    def in_range(self) -> ValidationFigures:
        """The validation of the smallest amplitudes."""
        return next(iter(self.ordered.values()))


def released_figures(provenance: Provenance | None) -> RunFigures | None:
    """Return the figures that an FMU carries; None where it was not measured.

    Raises:
        ValueError: what it carries is not what this version writes.
    """
    measured = (provenance or {}).get("measured")
    if measured is None:
        return None
    try:
        return read_figures(RunFigures, measured)
    except ValidationError as error:
        first, *others = error.errors()
        place, more = ".".join(map(str, first["loc"])), f" and {len(others)} more" * bool(others)
        raise ValueError(
            f"measured figures in the FMU: {place}{more}: {first['msg']}; expected those that "
            "this version of slide-fmu writes: make the FMU anew (slide-fmu run)"
        ) from error
