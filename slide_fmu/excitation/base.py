"""What all kinds of excitation share: a weight in the mix, and how their inputs are drawn."""

from __future__ import annotations

import abc
from typing import Annotated, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from slide_fmu.core.signals import FloatArray, Signal


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if not 0 <= pair[0] <= pair[1]:
        raise ValueError("expected two numbers, not negative, the smaller one first")
    return pair


def _ordered_counts(pair: tuple[int, int]) -> tuple[int, int]:
    if pair[0] > pair[1]:
        raise ValueError("expected two numbers, the smaller one first")
    return pair


PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Range = Annotated[tuple[float, float], AfterValidator(_ordered)]
PositiveRange = Annotated[tuple[PositiveFloat, PositiveFloat], AfterValidator(_ordered)]
CountRange = Annotated[
    tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]],
    AfterValidator(_ordered_counts),
]


class Kind(BaseModel, abc.ABC):
    """A kind of excitation with its weight in the mix. Interface: never instantiated."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    weight: float = Field(gt=0)

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse inputs that this kind cannot drive.

        Raises:
            ValueError: with what is wrong and the remedy.
        """

    def settings(self) -> dict[str, str]:
        """The values beside kind and weight by their names, as people read them."""
        fields = type(self).model_fields
        chosen = {name: value for name, value in self if name not in ("kind", "weight")}
        return {
            name: _as_text(value, ... in get_args(fields[name].annotation))
            for name, value in chosen.items()
        }

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
            signals: the inputs; ``check`` has passed them.
            time: sample times in s, evenly spaced, shape (N,).
            factor: on the amplitude; every kind says what it multiplies.

        Returns:
            Inputs in their units, shape (N, n_inputs).
        """


def _as_text(value: object, is_list: bool) -> str:
    """A value of a kind; two numbers that are no list are a range."""
    if isinstance(value, tuple):
        return (", " if is_list else " .. ").join(str(item) for item in value) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)
