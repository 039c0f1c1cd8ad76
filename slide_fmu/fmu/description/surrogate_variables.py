"""The variables of one surrogate's FMU are made from the table of kinds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from slide_fmu.core.signals import Signal
from slide_fmu.fmu.description.variables import (
    BOUND_FILLED,
    ESTIMATE_FILLED,
    KINDS,
    WINDOW_FILLED,
    VariableKind,
)
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True)
class Variable:
    """A Variable is one variable of an FMU.

    Attributes:
        kind: its row in the table, with type, causality and variability.
        reference: its value reference.
        unit: None for a Boolean.
        low, high, start: None if not given.
        size: number of values of an array; None for a scalar.
    """

    kind: VariableKind
    reference: int
    name: str
    description: str
    unit: str | None
    low: float | None
    high: float | None
    start: float | None
    size: int | None

    @property
    def causality(self) -> str:
        """The causality, as both standards name it."""
        return self.kind.causality

    @property
    def type(self) -> str:
        """``Real`` (Float64 in FMI 3.0) or ``Boolean``."""
        return self.kind.type


def fmu_variables(surrogate: Surrogate, fmi: FmiVersion = 2) -> list[Variable]:
    """List all variables of a surrogate's FMU, in the order of the table.

    Args:
        surrogate: the surrogate of the FMU.
        fmi: version of the standard; FMI 3.0 has more variables.

    Raises:
        ValueError: two variables would have the same name.
    """
    there = {
        "always": True,
        "estimator": surrogate.estimates_errors,
        "state_space": surrogate.network.measures_truncation,
        "several_samples": block_size(surrogate) > 1,
        "first_order": surrogate.hold == "first_order",
        "zero_order": surrogate.hold == "zero_order",
        "parameters": bool(surrogate.parameters),
        "bound": surrogate.bound is not None,
        "output_ranges": surrogate.output_ranges is not None,
        "known_start": shows_state(surrogate),
    }
    owners: dict[str, tuple[Signal | None, ...]] = {
        "one": (None,),
        "input": surrogate.inputs,
        "output": surrogate.outputs,
        "parameter": tuple(parameter.signal for parameter in surrogate.parameters),
    }
    variables = [
        _variable(surrogate, fmi, kind, index, signal)
        for kind in KINDS
        if kind.fmi <= fmi and there[kind.when]
        for index, signal in enumerate(owners[kind.per])
    ]
    names = [variable.name for variable in variables]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(
            f"surrogate {surrogate.name!r}: two variables of its FMU have the name {twice[0]!r}; "
            "expected unique names, rename the signal"
        )
    return variables


def require_free_names(
    inputs: Sequence[Signal], outputs: Sequence[Signal], parameters: Sequence[Signal]
) -> None:
    """Refuse signals and parameters whose variables would have equal names, in either standard.

    Raises:
        ValueError: two variables would have the same name; the message has the remedy.
    """
    none: tuple[Signal | None, ...] = (None,)
    owners = {"one": none, "input": inputs, "output": outputs, "parameter": parameters}
    names: dict[str, str] = {}
    for kind in KINDS:
        for signal in owners[kind.per]:
            name = kind.name_for("" if signal is None else signal.name)
            what = "every FMU" if signal is None else f"{kind.per} {signal.name!r}"
            if name in names:
                raise ValueError(
                    f"{names[name]} and {what} would both have a variable {name!r} in the FMU; "
                    "expected names of their own: rename the signal or the parameter"
                )
            names[name] = what


def memory_lengths(surrogate: Surrogate) -> dict[str, int]:
    """Return each memory length in samples, by the variable for the filled part of its inputs.

    Outputs need the memory of the network. Error estimates need the memory of the estimator over
    all its positions; without an estimator, of the companion and of the means of the estimates.
    Error bounds need the memory of the companion and of its means.
    """
    samples = {WINDOW_FILLED: surrogate.network.memory_length}
    if surrogate.estimator is not None:
        samples[ESTIMATE_FILLED] = surrogate.estimator.memory_length
    if surrogate.bound is not None and surrogate.bound.span is not None:
        samples[ESTIMATE_FILLED] = surrogate.bound.estimate_length
    if surrogate.bound is not None:
        samples[BOUND_FILLED] = surrogate.bound.filling_length
    return samples


def shows_state(surrogate: Surrogate) -> bool:
    """Tell whether outputs before the start can show the state of the network there.

    With physical parameters, it would follow these too.
    """
    return surrogate.network.measures_truncation and not surrogate.parameters


def block_size(surrogate: Surrogate) -> int:
    """Return the number of output samples that the network knows at a time.

    A feed-forward network gives them at once; with a state-space network they are the output
    window.
    """
    return surrogate.network.block_length(len(surrogate.outputs))


def initial_dependencies(variables: Sequence[Variable]) -> Iterator[tuple[int, list[int]]]:
    """Yield each output and its dependencies in initialization mode, by positions.

    Outputs follow from past inputs only; before the first step from the start inputs, or from the
    initial ones. The filled parts do not depend on inputs, only on whether the inputs before the
    start are known.
    """
    known = {
        "nothing": [],
        "prehistory": [i for i, v in enumerate(variables) if v.kind.key == "PREHISTORY_KNOWN"],
        "everything": [
            i for i, v in enumerate(variables) if v.causality in ("input", "parameter")
        ],
    }
    for i, variable in enumerate(variables):
        if variable.causality == "output":
            yield i, known[variable.kind.initially]


def _variable(
    surrogate: Surrogate, fmi: FmiVersion, kind: VariableKind, index: int, signal: Signal | None
) -> Variable:
    sizes = {"scalar": None, "block": block_size(surrogate)}
    size = sizes.get(kind.size, surrogate.memory_length)
    unit = signal.unit if kind.unit is None and signal is not None else kind.unit
    own = (None,) * 3 if signal is None else (signal.low, signal.high, signal.start_value)
    of_surrogate = float(surrogate.inputs_at_step_end)
    low, high, start = (
        of_signal if bound == "signal" else of_surrogate if bound == "surrogate" else bound
        for bound, of_signal in zip(kind.bounds, own, strict=True)
    )
    if kind.key == "CONFIDENCE" and surrogate.bound is not None:
        high = surrogate.bound.confidences[-1]
    if kind.key == "ERROR_TOLERANCE":
        start = float(surrogate.error_tolerances[index])
    if fmi == 3 and kind.high_fmi_3 is not None:
        high = kind.high_fmi_3 - (not shows_state(surrogate))
    return Variable(
        kind,
        kind.reference(index),
        kind.name_for("" if signal is None else signal.name),
        _description(surrogate, fmi, kind, signal, size),
        unit,
        low,
        high,
        start,
        size,
    )


def _description(
    surrogate: Surrogate,
    fmi: FmiVersion,
    kind: VariableKind,
    signal: Signal | None,
    size: int | None,
) -> str:
    """Return the description from the table; for inputs and outputs that of the signal, if any."""
    if signal is not None and kind.name == "{signal}" and signal.description:
        return signal.description
    estimated = surrogate.estimates_errors
    text = f"{kind.text} {kind.text_fmi_3}" if fmi == 3 and kind.text_fmi_3 else kind.text
    return text.format(
        signal="" if signal is None else signal.name,
        positions=surrogate.estimated_samples if estimated else 0,
        size=size,
    )
