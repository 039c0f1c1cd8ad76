"""This module describes an FMU of slide-fmu, as ``slide-fmu info --json`` writes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from slide_fmu.core.figures import optional, plain
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.signals import FloatArray, Hold, Signal
from slide_fmu.core.window import Window
from slide_fmu.fmu.export import Provenance
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True, kw_only=True)
class BoundDescription:
    """This describes an error bound: sizes, confidences, and lengths in s.

    Attributes:
        companion_parameters, head_parameters: numbers of the weights of its networks.
        confidences: the confidences for which it has a bound.
        blocks_s: lengths of the blocks of its means.
        estimate_span_s: time over which the same networks estimate the error; None if they do not.
        tolerances: largest 95 % bounds that are trusted at the start, one of each output in its
            unit.
    """

    companion_parameters: int
    head_parameters: int
    confidences: tuple[float, ...]
    blocks_s: tuple[float, ...]
    estimate_span_s: float | None = optional()
    tolerances: tuple[float, ...]

    @classmethod
    def of(cls, bound: ErrorBound, step: float, scales: FloatArray) -> BoundDescription:
        """Describe a bound of samples of a step in s, of outputs with these scales."""
        return cls(
            companion_parameters=bound.companion.count_parameters(),
            head_parameters=bound.head.count_parameters(),
            confidences=tuple(bound.confidences),
            blocks_s=tuple(length * step for length in bound.blocks),
            estimate_span_s=None if bound.span is None else bound.span.samples * step,
            tolerances=tuple((bound.tolerances * scales).tolist()),
        )


@dataclass(frozen=True)
class FmuDescription:
    """This describes an FMU.

    Attributes:
        name: name of the surrogate.
        inputs, outputs: its signals.
        hold: how inputs act between samples.
        window: how many samples its network sees and returns.
        memory_s: time in s for which its outputs depend on an input.
        planned: whether its inputs are planned motions.
        parameters: number of the network's weights.
        estimator_parameters: number of weights of the error estimator; None without one.
        error_bound: None without one.
        physical_parameters: the parameters that a user sets.
        provenance: its origin; None if it is unknown.
    """

    name: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    hold: Hold
    window: Window
    memory_s: float
    planned: bool
    parameters: int
    estimator_parameters: int | None
    error_bound: BoundDescription | None = optional()
    physical_parameters: tuple[Parameter, ...] = optional(())
    provenance: Provenance | None = None

    @classmethod
    def of(cls, surrogate: Surrogate, provenance: Provenance | None) -> FmuDescription:
        """Describe a surrogate with its provenance."""
        step, estimator, bound = surrogate.window.step, surrogate.estimator, surrogate.bound
        return cls(
            name=surrogate.name,
            inputs=surrogate.inputs,
            outputs=surrogate.outputs,
            hold=surrogate.hold,
            window=surrogate.window,
            memory_s=surrogate.network.memory_length * step,
            planned=surrogate.planned,
            parameters=surrogate.network.count_parameters(),
            estimator_parameters=None
            if estimator is None
            else estimator.network.count_parameters(),
            error_bound=None
            if bound is None
            else BoundDescription.of(bound, step, surrogate.output_scaling.scale),
            physical_parameters=surrogate.parameters,
            provenance=provenance,
        )

    def dump(self) -> Any:
        """Return plain values; outputs have neither hold nor angle."""
        found = plain(self)
        for output in found["outputs"]:
            del output["hold"], output["angle"]
        return found
