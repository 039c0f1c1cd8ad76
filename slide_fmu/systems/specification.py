"""A Specification describes the reference system of a recipe by plain values.

It can be sent to other processes, also as text.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field, InstanceOf, TypeAdapter

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.suggestions import or_meant
from slide_fmu.core.units import are_other, behind
from slide_fmu.systems.base import System
from slide_fmu.systems.declared import Parameter, SignalTable, SignalTables
from slide_fmu.systems.errors import LoadError


@dataclass(frozen=True)
class Specification:
    """A Specification holds all that a reference system is made from.

    Attributes:
        model: name or path of the model; of a class, ``"package.module:Class"``.
        parameters: values of the model's parameters, by name.
        step: sample step h in s; the model's own if None, where it has one.
        kind: one of ``slide_fmu.systems.loading.KINDS``.
        inputs, outputs: tables of signals in the recipe, in its order.
        further: for records, files in addition to ``model``.
        part_of: number of such steps in a sample step of the surrogate; more than one of a system
            that is simulated between samples too.
        noise_record: for records, a file that was measured at rest; None without one.
        given: for an object, the system itself, which no text holds.
    """

    model: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    step: float | None = None
    kind: str = "class"
    inputs: SignalTables = field(default_factory=dict)
    outputs: SignalTables = field(default_factory=dict)
    further: tuple[str, ...] = ()
    noise_record: str | None = None
    part_of: int = 1
    given: Annotated[InstanceOf[System] | None, Field(exclude=True)] = field(
        default=None, repr=False
    )

    def to_json(self) -> str:
        """Write the specification as one line of JSON."""
        return TypeAdapter(Specification).dump_json(self).decode()

    @staticmethod
    def from_json(text: str) -> Specification:
        """Read the text of ``to_json``."""
        return TypeAdapter(Specification).validate_json(text)

    def sample_step(self) -> float:
        """Give the sample step h in s, which models of most kinds have not themselves.

        Raises:
            LoadError: the step is missing.
        """
        if self.step is None or not self.step > 0:
            raise LoadError(
                f"system {self.model!r}: sample step {self.step}; expected a positive one in s: "
                "give it as window.step in the recipe, or with --step to slide-fmu init"
            )
        return self.step


def chosen_signals(label: str, offered: SignalTables, chosen: SignalTables) -> tuple[Signal, ...]:
    """Return the signals that a model offers, completed by the recipe.

    Args:
        label: ``"input"`` or ``"output"``, for messages.
        offered: all that the model has, in its order; all of them become signals.
        chosen: the tables of the recipe.

    Raises:
        LoadError: the recipe names signals that are not there, or other units than the model's,
            or a range is not known.
    """
    _require_offered(label, offered, chosen)
    for name, table in chosen.items():
        if are_other(table.unit, offered[name].unit):
            raise LoadError(
                f"{label} {name!r} is in {table.unit} in the recipe, and in {offered[name].unit} "
                "in the model; expected the model's unit, since values are not converted"
            )
    return tuple(
        chosen.get(name, SignalTable()).over(table).signal(label, name)
        for name, table in offered.items()
    )


def chosen_outputs(offered: SignalTables, chosen: SignalTables) -> SignalTables:
    """Give those outputs of a model that the recipe names, in its order; all if it names none.

    Raises:
        LoadError: the recipe names outputs that are not there.
    """
    _require_offered("output", offered, chosen)
    return {name: offered[name] for name in chosen} or offered


def require_straight_inputs(inputs: tuple[Signal, ...]) -> None:
    """Refuse angles that turn within a step, for models whose inputs move along straight lines.

    Raises:
        LoadError: there is a cosine or sine with a first-order hold.
    """
    turning = [one.name for one in inputs if one.angle and one.hold == "first_order"]
    if turning:
        raise LoadError(
            f"inputs {turning} are cosine and sine of an angle with a first-order hold; "
            "expected inputs that move linearly: give the angle itself as the input"
        )


def values_text(signals: tuple[Signal, ...], values: FloatArray) -> str:
    """Write values of signals, shape (n_signals,), for example ``"road = 0.1 m"``."""
    pairs = zip(signals, values, strict=True)
    return ", ".join(f"{one.name} = {value:.6g}{behind(one.unit)}" for one, value in pairs)


def _require_offered(label: str, offered: SignalTables, chosen: SignalTables) -> None:
    names, unknown = list(offered), [name for name in chosen if name not in offered]
    if unknown:
        raise LoadError(
            f"system.{label}s of the recipe name {unknown}; expected some of the model's {names}: "
            "correct them, or write the recipe anew (slide-fmu init MODEL --force; the model "
            f"stays){or_meant(unknown, names)}"
        )
