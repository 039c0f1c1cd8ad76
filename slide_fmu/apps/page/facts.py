"""A page knows the variables of a surrogate by the value references of its FMU."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from slide_fmu.core.signals import Angle, Hold, Signal
from slide_fmu.fmu.description.surrogate_variables import fmu_variables, memory_lengths
from slide_fmu.fmu.description.variables import AT_STEP_END, BY_KEY, CONFIDENCE, HELD
from slide_fmu.fmu.export import Provenance
from slide_fmu.report.run_figures import released_figures
from slide_fmu.surrogate.surrogate import Surrogate

FLAGS = (
    *("WINDOW_FILLED", "ESTIMATE_FILLED", "IN_RANGE"),
    *("IN_DOMAIN", "NOVELTY", "BOUND_FILLED", "TRUSTED"),
)
"""Kinds of variables that say how reliable the outputs are."""


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
    known: int | None
    usual: float | None


def facts_of(surrogate: Surrogate, provenance: Provenance | None = None) -> PageFacts:
    """Return the facts about a surrogate for a page.

    Raises:
        ValueError: the measured figures are not of the form that this version writes.
    """
    references = {variable.name: variable.reference for variable in fmu_variables(surrogate)}
    step, estimated = surrogate.window.step, surrogate.estimates_errors
    flags = [BY_KEY[key].name for key in FLAGS]
    return PageFacts(
        name=surrogate.name,
        step=step,
        hold=surrogate.hold,
        memory=step * surrogate.network.memory_length,
        past=step * max(memory_lengths(surrogate).values()),
        estimated=step * surrogate.estimated_samples if estimated else None,
        inputs=_variables(surrogate.inputs, references),
        outputs=tuple(_output(signal, references) for signal in surrogate.outputs),
        parameters=_variables([p.signal for p in surrogate.parameters], references),
        flags={name: references[name] for name in flags if name in references},
        confidence=_confidence(surrogate, references),
        known=references.get(AT_STEP_END, references.get(HELD)),
        usual=_usual_error(surrogate, provenance),
    )


def _usual_error(surrogate: Surrogate, provenance: Provenance | None) -> float | None:
    if surrogate.bound is not None or surrogate.estimates_errors:
        return None
    figures = released_figures(provenance)
    return None if figures is None else figures.usual_error


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


def _confidence(surrogate: Surrogate, references: Mapping[str, int]) -> PageConfidence | None:
    if surrogate.bound is None:
        return None
    low, _, start = BY_KEY["CONFIDENCE"].bounds
    assert isinstance(low, float)
    assert isinstance(start, float)
    return PageConfidence(low, surrogate.bound.confidences[-1], start, references[CONFIDENCE])
