"""A page knows the variables of a surrogate by the value references of its FMU."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from slide_fmu.core.signals import Angle, Hold, Signal
from slide_fmu.fmu.description.surrogate_variables import fmu_variables, memory_lengths
from slide_fmu.fmu.description.variables import (
    BY_KEY,
    CONFIDENCE,
    ESTIMATE_FILLED,
    IN_RANGE,
    TRUST,
    WINDOW_FILLED,
    known_inputs,
)
from slide_fmu.fmu.export import Provenance
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate

FLAGS = (WINDOW_FILLED, ESTIMATE_FILLED, IN_RANGE, *TRUST)
"""Variables that say how reliable the outputs are."""


@dataclass(frozen=True)
class PageVariable:
    """A PageVariable is an input or a parameter; ``reference`` is its value reference."""

    name: str
    unit: str
    low: float
    high: float
    start: float
    angle: Angle | None
    description: str
    reference: int


@dataclass(frozen=True)
class PageOutput(PageVariable):
    """A PageOutput is an output of a page.

    Attributes:
        estimate, bound: value references of its error estimate and error bound; None if there are
            none.
    """

    estimate: int | None
    bound: int | None


@dataclass(frozen=True)
class PageConfidence:
    """A PageConfidence is the confidence of an error bound, which the user of a page chooses."""

    low: float
    high: float
    start: float
    reference: int


@dataclass(frozen=True, kw_only=True)
class PageFacts:
    """PageFacts are the facts about a surrogate from which a page makes its controls and plots.

    Attributes:
        name: name of the surrogate.
        step: its step in s.
        hold: how inputs act between samples.
        memory: time in s for which its outputs depend on an input.
        past: the same for outputs, error estimates and error bounds: the longest.
        estimated: time in s over which the error is estimated; None without an estimate.
        inputs, outputs, parameters: its variables.
        flags: value references of the variables that say how reliable the outputs are, by name.
        confidence: None without an error bound.
        known: value reference of ``inputs_at_step_end`` or ``inputs_held``, by which the page says
            that what it sets is all that the inputs do in a step, as in a move that is planned.
        usual: without error bound and estimate, the RMS error that was measured in range, as a
            norm over the outputs; else None.
    """

    name: str
    step: float
    hold: Hold
    memory: float
    past: float
    estimated: float | None
    inputs: tuple[PageVariable, ...]
    outputs: tuple[PageOutput, ...]
    parameters: tuple[PageVariable, ...]
    flags: Mapping[str, int]
    confidence: PageConfidence | None
    known: int
    usual: float | None


def page_facts(surrogate: Surrogate, provenance: Provenance | None = None) -> PageFacts:
    """Return the facts about a surrogate for a page.

    Raises:
        ValueError: the measured figures are not of the form that this version writes.
    """
    described = FmuDescription.of(surrogate, provenance)
    one = described.surrogate
    references = {variable.name: variable.reference for variable in fmu_variables(surrogate)}
    return PageFacts(
        name=one.name,
        step=one.window.step,
        hold=one.hold,
        memory=one.memory_s,
        past=one.window.step * max(memory_lengths(surrogate).values()),
        estimated=one.estimate_span_s,
        inputs=_variables(one.inputs, references),
        outputs=tuple(_output(signal, references) for signal in one.outputs),
        parameters=_variables([p.signal for p in one.physical_parameters], references),
        flags={name: references[name] for name in FLAGS if name in references},
        confidence=_confidence(one, references),
        known=references[known_inputs(references)],
        usual=_usual_error(described),
    )


def _usual_error(described: FmuDescription) -> float | None:
    one = described.surrogate
    if one.error_bound is not None or one.estimate_span_s is not None:
        return None
    return None if described.measured is None else described.measured.usual_error


def names_of(surrogate: Surrogate) -> list[str]:
    """Return the names of inputs, outputs and parameters, which a drawing may use."""
    owners = (surrogate.inputs, surrogate.outputs, surrogate.parameters)
    return [signal.name for group in owners for signal in group]


def _variables(
    signals: Sequence[Signal], references: Mapping[str, int]
) -> tuple[PageVariable, ...]:
    return tuple(_variable(signal, references) for signal in signals)


def _variable(signal: Signal, references: Mapping[str, int]) -> PageVariable:
    return PageVariable(
        name=signal.name,
        unit=signal.unit,
        low=signal.low,
        high=signal.high,
        start=signal.start_value,
        angle=signal.angle,
        description=signal.description,
        reference=references[signal.name],
    )


def _output(signal: Signal, references: Mapping[str, int]) -> PageOutput:
    estimate, bound = (
        references.get(BY_KEY[key].name_for(signal.name))
        for key in ("ERROR_ESTIMATE", "ERROR_BOUND")
    )
    return PageOutput(**vars(_variable(signal, references)), estimate=estimate, bound=bound)


def _confidence(
    described: SurrogateDescription, references: Mapping[str, int]
) -> PageConfidence | None:
    if described.error_bound is None:
        return None
    low, _, start = BY_KEY["CONFIDENCE"].bounds
    assert isinstance(low, float)
    assert isinstance(start, float)
    return PageConfidence(
        low, described.error_bound.confidences[-1], start, references[CONFIDENCE]
    )
