"""What a recipe says about its reference system, as plain values that cross to other processes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from slide_fmu.core.signals import Angle, Hold, Signal
from slide_fmu.core.suggestions import or_meant
from slide_fmu.systems.base import Parameter
from slide_fmu.systems.errors import LoadError


@dataclass(frozen=True)
class SignalChoice:
    """A SignalChoice says about an input or output what its model leaves open; None: nothing.

    Attributes:
        name: name of the signal in the model.
        unit, low, high, description, start, hold, angle, period: as of
            ``slide_fmu.core.signals.Signal``.
        column: of records, the name of its column; that of the signal if None.
    """

    name: str
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    description: str | None = None
    start: float | None = None
    hold: Hold | None = None
    angle: Angle | None = None
    period: float | None = None
    column: str | None = None

    def over(self, other: SignalChoice) -> SignalChoice:
        """Give the choice that says what this one says, and elsewhere what the other one says."""
        own = {key: value for key, value in asdict(self).items() if value is not None}
        return replace(other, **own)

    def signal(self, what: str) -> Signal:
        """Give the signal; ``what`` begins the message, for example ``"input"``.

        Raises:
            LoadError: the range is not known, or a value cannot be that of a signal.
        """
        low, high = self.low, self.high
        if low is None or high is None:
            raise LoadError(
                f"{what} {self.name!r} has no range; expected one in the recipe: add "
                f"system.{what}s.{self.name}.range = [LOW, HIGH]"
            )
        given = {key: value for key, value in asdict(self).items() if value is not None}
        given.pop("column", None)
        try:
            return Signal(**{"unit": "1", **given})
        except ValueError as error:
            raise LoadError(f"{what} {str(error).removeprefix('signal ')}") from error


@dataclass(frozen=True)
class Specification:
    """A Specification is all that a reference system is made from.

    Attributes:
        model: what the kind makes a system from; of a class, ``"package.module:Class"``.
        parameters: values of the model's parameters, by name.
        step: sample step h in s; that of the model if None, where it has one.
        kind: one of ``slide_fmu.systems.loading.KINDS``.
        inputs, outputs: what the recipe says about signals, in its order.
        further: of records, further files beside ``model``.
        part_of: number of such steps in a sample step of the surrogate; more than one of a system
            that is simulated between samples too.
        noise_record: of records, a file that was taken while nothing moved; None if there is none.
    """

    model: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    step: float | None = None
    kind: str = "class"
    inputs: tuple[SignalChoice, ...] = ()
    outputs: tuple[SignalChoice, ...] = ()
    further: tuple[str, ...] = ()
    noise_record: str | None = None
    part_of: int = 1

    def to_json(self) -> str:
        """Write the specification as one line of JSON, the same for the same values."""
        return json.dumps({**asdict(self), "parameters": dict(self.parameters)}, sort_keys=True)

    @staticmethod
    def from_json(text: str) -> Specification:
        """Read what ``to_json`` wrote."""
        values: dict[str, Any] = json.loads(text)
        signals = {
            name: tuple(SignalChoice(**choice) for choice in values[name])
            for name in ("inputs", "outputs")
        }
        return Specification(**{**values, **signals, "further": tuple(values["further"])})

    def sample_step(self) -> float:
        """Give the sample step h in s, which models of most kinds have not themselves.

        Raises:
            LoadError: there is none.
        """
        if self.step is None or not self.step > 0:
            raise LoadError(
                f"system {self.model!r}: sample step {self.step}; expected a positive one in s: "
                "give it as window.step in the recipe, or with --step to slide-fmu init"
            )
        return self.step


def chosen_signals(
    what: str, offered: tuple[SignalChoice, ...], chosen: tuple[SignalChoice, ...]
) -> tuple[Signal, ...]:
    """Give the signals that a model offers, with what the recipe says about them.

    Args:
        what: ``"input"`` or ``"output"``, for messages.
        offered: all that the model has, in its order; all of them become signals.
        chosen: what the recipe says.

    Raises:
        LoadError: the recipe names signals that are not there, or a range is not known.
    """
    _require_offered(what, offered, chosen)
    said = {choice.name: choice for choice in chosen}
    return tuple(said.get(o.name, SignalChoice(o.name)).over(o).signal(what) for o in offered)


def chosen_outputs(
    offered: tuple[SignalChoice, ...], chosen: tuple[SignalChoice, ...]
) -> tuple[SignalChoice, ...]:
    """Give those outputs of a model that the recipe names, in its order; all if it names none.

    Raises:
        LoadError: the recipe names outputs that are not there.
    """
    _require_offered("output", offered, chosen)
    by_name = {choice.name: choice for choice in offered}
    return tuple(by_name[choice.name] for choice in chosen) or offered


def _require_offered(
    what: str, offered: tuple[SignalChoice, ...], chosen: tuple[SignalChoice, ...]
) -> None:
    names = [choice.name for choice in offered]
    unknown = [choice.name for choice in chosen if choice.name not in names]
    if unknown:
        raise LoadError(
            f"system.{what}s of the recipe name {unknown}; expected some of the model's {names}: "
            f"correct or remove them{or_meant(unknown, names)}"
        )
