"""What can be found out about a model before there is a recipe for it."""

from __future__ import annotations

from dataclasses import dataclass

from slide_fmu.systems.base import Parameter
from slide_fmu.systems.specification import SignalChoice


@dataclass(frozen=True)
class FoundParameter:
    """A FoundParameter is a parameter that a model declares, with the value that it has."""

    name: str
    value: Parameter
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Found:
    """A Found says what a model declares: the module of every kind has ``describe`` to find it.

    Attributes:
        kind: one of ``slide_fmu.systems.loading.KINDS``.
        model: what a recipe calls the model.
        parameters: parameters of the model, in its order.
        inputs, outputs: its signals, in its order; what it leaves open is None.
        step: sample step h in s that the model suggests; None where it suggests none.
        held_step: the step in s by which an importer runs it, its inputs held over it, where a
            co-simulation FMU names one and its inputs are not discrete.
        remarks: one sentence each on what was assumed, for people.
        inputs_may_be_left_out: whether a recipe may name some of the inputs alone; the others keep
            their start values.
    """

    kind: str
    model: str
    parameters: tuple[FoundParameter, ...]
    inputs: tuple[SignalChoice, ...]
    outputs: tuple[SignalChoice, ...]
    step: float | None = None
    held_step: float | None = None
    remarks: tuple[str, ...] = ()
    inputs_may_be_left_out: bool = False
