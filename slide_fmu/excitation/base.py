"""All kinds of excitation share what is here: a weight in the mix, and one method that draws.

The annotated types are those of the fields that recipes set; pydantic checks them.
"""

from __future__ import annotations

import abc
from typing import Annotated, ClassVar, get_args

import numpy as np
from pydantic import AfterValidator, Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.toml_table import Table


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise ValueError("expected two numbers, the smaller one first")
    return pair


NonNegativeFloat = Annotated[float, Field(ge=0, allow_inf_nan=False)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
"""The value is a finite number above 0."""
Count = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(ge=0, le=1)]
"""The value is a share or a probability, from 0 to 1."""
Range = Annotated[tuple[NonNegativeFloat, NonNegativeFloat], AfterValidator(_ordered)]
"""The value is a range: its lower and its upper end, neither of them negative."""
PositiveRange = Annotated[tuple[PositiveFloat, PositiveFloat], AfterValidator(_ordered)]
"""The value is a range whose ends are both above 0, the lower end first."""
CountRange = Annotated[tuple[Count, Count], AfterValidator(_ordered)]
"""The value is a range of whole numbers from 1, and both ends belong to it."""
Limits = tuple[PositiveFloat, ...]
"""The value holds one limit for each input, in their order, or nothing."""


class Kind(Table, abc.ABC):
    """One kind of excitation draws all inputs of a trajectory. Interface: never instantiated.

    Subclasses are final. Each has a field ``kind`` with its name in recipes.

    Attributes:
        kind: name of the kind, which must be there.
        weight: how often this kind is drawn, relative to the weights of the others in the mix.
        bends: whether inputs are smooth functions of time, which bend between samples. Others are
            known at samples alone, and go straight from one to the next.
    """

    bends: ClassVar[bool] = False

    weight: float = Field(gt=0)

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse inputs that this kind cannot drive; a kind without conditions accepts all.

        Raises:
            ValueError: the inputs do not suit the kind; the message says why, and the remedy.
        """

    def settings(self) -> dict[str, str]:
        """Return the fields beside ``kind`` and ``weight`` by name, as text for reports.

        A switch that is off is left out.
        """
        fields = type(self).model_fields
        left_out = {"kind", "weight", *(name for name, value in self if value is False)}
        chosen = {name: value for name, value in self if name not in left_out}
        return {
            name: _as_text(value, ... in get_args(fields[name].annotation))
            for name, value in chosen.items()
        }

    @abc.abstractmethod
    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        """Say in one sentence, without its full stop, what the inputs do.

        It stands behind a colon, and speaks of what is drawn at the amplitude factor 1.

        Args:
            signals: the inputs in channel order; ``check`` has accepted them.
            step: time between samples in s.
        """

    @abc.abstractmethod
    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw one realisation for all inputs together.

        Args:
            signals: the inputs in channel order; ``check`` has accepted them.
            time: sample times in s, evenly spaced, shape (N,).
            factor: amplitude factor; every kind says what it multiplies. Above 1 inputs leave
                their range, or move faster.
            rng: the only source of randomness.

        Returns:
            Inputs in the units of their signals, time first, then channel: shape (N, n_inputs).
        """


def _as_text(value: object, is_list: bool) -> str:
    """Write a value of a field; two numbers whose type is no list of any length are a range."""
    if isinstance(value, tuple):
        return (", " if is_list else " .. ").join(str(item) for item in value) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


def require_one_each(
    kind: str, name: str, limits: tuple[float, ...], signals: tuple[Signal, ...]
) -> None:
    """Refuse limits of a kind of excitation that are not one for each input.

    Raises:
        ValueError: the message has the kind, the limits' name, and the remedy.
    """
    if len(limits) != len(signals):
        raise ValueError(
            f"kind = {kind!r}: {name} has {len(limits)} values; expected {len(signals)}, one for "
            f"each input {[signal.name for signal in signals]}: correct the list"
        )
