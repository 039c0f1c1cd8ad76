"""A surrogate is described once: what it is, and what it knows of its error.

``repr``, ``slide-fmu info``, model card, report, page and credentials show this description, so
that they cannot contradict each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from slide_fmu.core.figures import optional
from slide_fmu.core.measures import percent
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.core.signals import Hold, Signal
from slide_fmu.core.units import behind
from slide_fmu.core.window import Window
from slide_fmu.network.bytes import family_of
from slide_fmu.network.state_space.network import StateSpace

if TYPE_CHECKING:  # a surrogate describes itself by this module
    from slide_fmu.surrogate.surrogate import Surrogate

ACTS: dict[Hold, str] = {
    "zero_order": "is held over a step",
    "first_order": "moves between samples",
}
"""How inputs act between samples, in words."""

SIGNAL_COLUMNS = "signal", "range", "acts", "meaning"
"""Columns of a table of signals."""

RANGE_DIGITS = 4
"""Digits of the ranges that outputs had in the training, which are measured."""

LABEL = 9
"""Width of the labels of ``SurrogateDescription.lines`` where they stand below each other."""


@dataclass(frozen=True, kw_only=True)
class BoundDescription:
    """This describes an error bound: sizes, confidences, and times in s.

    Attributes:
        companion_parameters, head_parameters: numbers of the weights of its networks.
        confidences: the confidences for which it has a bound.
        blocks_s: lengths of the blocks of its means.
        filled_s: time after the start from which on it counts.
        tolerances: largest 95 % bounds that are trusted at the start, one of each output in its
            unit. They are the start values of the FMU's parameters ``<output>_error_tolerance``.
    """

    companion_parameters: int
    head_parameters: int
    confidences: tuple[float, ...]
    blocks_s: tuple[float, ...]
    filled_s: float
    tolerances: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class SurrogateDescription:
    """This describes a surrogate.

    Attributes:
        name: name of the surrogate and of its FMU.
        inputs, outputs: its signals, as they were declared.
        output_ranges: lowest and highest value of each output in the training, where known.
        hold: how inputs act between samples.
        window: how many samples its network sees and returns, and its own step.
        memory_s: time in s for which its outputs depend on an input.
        planned: whether its inputs are planned motions.
        inputs_at_step_end: whether the FMU, as it starts, takes inputs as reached by a step's end.
        family: family of the network.
        states, hidden_units: of a state-space network.
        parameters: number of the network's weights.
        estimator_parameters: number of weights of the error estimator; None without one.
        estimate_span_s: time in s over which it estimates its error; None if it does not.
        error_bound: None without one.
        physical_parameters: the parameters that a user sets.
    """

    name: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    output_ranges: tuple[tuple[float, float], ...] | None = optional()
    hold: Hold
    window: Window
    memory_s: float
    planned: bool
    inputs_at_step_end: bool
    family: str
    states: int | None = optional()
    hidden_units: int | None = optional()
    parameters: int
    estimator_parameters: int | None
    estimate_span_s: float | None = optional()
    error_bound: BoundDescription | None = optional()
    physical_parameters: tuple[Parameter, ...] = optional(())

    @classmethod
    def of(cls, surrogate: Surrogate) -> SurrogateDescription:
        """Describe a surrogate."""
        step, network, estimator = surrogate.window.step, surrogate.network, surrogate.estimator
        ranges = surrogate.output_ranges
        cell = network.cell if isinstance(network, StateSpace) else None
        return cls(
            name=surrogate.name,
            inputs=surrogate.inputs,
            outputs=surrogate.outputs,
            output_ranges=None if ranges is None else tuple((a, b) for a, b in ranges.tolist()),
            hold=surrogate.hold,
            window=surrogate.window,
            memory_s=network.memory_length * step,
            planned=surrogate.planned,
            inputs_at_step_end=surrogate.inputs_at_step_end,
            family=family_of(network).name,
            states=None if cell is None else len(cell.a),
            hidden_units=None if cell is None else len(cell.w),
            parameters=network.count_parameters(),
            estimator_parameters=(
                None if estimator is None else estimator.network.count_parameters()
            ),
            estimate_span_s=(
                surrogate.estimated_samples * step if surrogate.estimates_errors else None
            ),
            error_bound=_bound_of(surrogate),
            physical_parameters=surrogate.parameters,
        )

    @property
    def forecasts_inputs(self) -> bool:
        """Whether the FMU, as it starts, forecasts its inputs within a step."""
        return self.hold == "first_order" and not self.inputs_at_step_end

    @property
    def tolerances(self) -> list[tuple[str, str]]:
        """The tolerance at the start and the name of each output; none without a bound."""
        if self.error_bound is None:
            return []
        pairs = zip(self.error_bound.tolerances, self.outputs, strict=True)
        return [(quantity(tolerance, one.unit), one.name) for tolerance, one in pairs]

    @property
    def tolerance_text(self) -> str:
        """The tolerances at the start, in words."""
        return ", ".join(f"{size} of {name}" for size, name in self.tolerances)

    @property
    def network_text(self) -> str:
        """Family and sizes of the network, in words."""
        sizes = f" of {self.states} states and {self.hidden_units} hidden units"
        return f"{self.family}{'' if self.states is None else sizes}, {self.parameters} weights"

    @property
    def trained_outputs(self) -> tuple[Signal, ...]:
        """The outputs with the ranges that they had in the training, where these are known."""
        if self.output_ranges is None:
            return self.outputs
        ends = [[float(f"{end:.{RANGE_DIGITS}g}") for end in pair] for pair in self.output_ranges]
        pairs = zip(self.outputs, ends, strict=True)
        return tuple(
            replace(signal, low=low, high=high, start=None) if low < high else signal
            for signal, (low, high) in pairs
        )

    def signal_rows(self) -> list[tuple[str, str, str, str]]:
        """Return a row for each signal and parameter, with the ranges of the training."""
        return signal_rows(self.inputs, self.trained_outputs, self.physical_parameters)

    def lines(self) -> list[tuple[str, str]]:
        """Return what is said of window, network, error estimate and bound, each with a label."""
        n_in, n_out, step = self.window.n_in, self.window.n_out, self.window.step
        rows = [
            ("window", window_text(n_in, n_out, step)),
            ("memory", f"outputs depend on the inputs of the last {decimal(self.memory_s)} s"),
            ("network", self.network_text),
        ]
        if self.estimate_span_s is not None:
            by = "the networks of the bound"
            if self.estimator_parameters is not None:
                by = f"an estimator of {self.estimator_parameters} weights"
            rows.append(("estimate", f"of the error over {self.estimate_span_s:g} s, by {by}"))
        if self.error_bound is not None:
            confidences = _either([percent(one) for one in self.error_bound.confidences])
            text = f"of the error, with a confidence of {confidences}"
            rows.append(("bound", f"{text}; at the start, tolerances are {self.tolerance_text}"))
        return rows

    def __str__(self) -> str:
        """Describe the surrogate in a few lines."""
        signals = (f"{what}: {limits}" for what, limits, *_ in self.signal_rows())
        lines = (f"{label:{LABEL}}{text}" for label, text in self.lines())
        return "\n  ".join([f"Surrogate {self.name!r}", *signals, *lines])


def _bound_of(surrogate: Surrogate) -> BoundDescription | None:
    bound, step = surrogate.bound, surrogate.window.step
    if bound is None:
        return None
    return BoundDescription(
        companion_parameters=bound.companion.count_parameters(),
        head_parameters=bound.head.count_parameters(),
        confidences=tuple(bound.confidences),
        blocks_s=tuple(length * step for length in bound.blocks),
        filled_s=bound.filling_length * step,
        tolerances=tuple(surrogate.error_tolerances.tolist()),
    )


def signal_rows(
    inputs: Sequence[Signal], outputs: Sequence[Signal], parameters: Sequence[Parameter] = ()
) -> list[tuple[str, str, str, str]]:
    """Return name, range, action and meaning of each signal and parameter (``SIGNAL_COLUMNS``)."""
    return [
        *(_row("input", signal, ACTS[signal.hold]) for signal in inputs),
        *(_row("output", signal) for signal in outputs),
        *(_row("parameter", parameter) for parameter in parameters),
    ]


def _row(what: str, one: Signal | Parameter, acts: str = "") -> tuple[str, str, str, str]:
    limits = f"{one.low:g} .. {one.high:g}{behind(one.unit)}"
    return f"{what} {one.name}", limits, acts, one.description


def window_text(n_in: int, n_out: int, step: float) -> str:
    """Say what a window is, of samples of a step in s."""
    samples = f"{n_in} samples of the inputs and gives {n_out} of the outputs"
    return f"the network sees {samples}; a sample is {step:.10g} s"


def _either(texts: Sequence[str]) -> str:
    *others, last = texts
    return f"{', '.join(others)} or {last}" if others else last
