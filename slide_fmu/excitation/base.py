"""All kinds of excitation have a weight in the mix and one method that draws inputs.

The annotated types are for fields that recipes set; pydantic checks them.
"""

from __future__ import annotations

import abc
from typing import Annotated, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.toml_table import Table


def ordered(pair: tuple[float, float]) -> tuple[float, float]:
    """Return a range; refuse one whose larger end comes first."""
    if pair[0] > pair[1]:
        raise ValueError("expected two numbers, the smaller one first")
    return pair


NonNegativeFloat = Annotated[float, Field(ge=0, allow_inf_nan=False)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
"""A finite number above 0."""
Count = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(ge=0, le=1)]
"""A share or a probability, from 0 to 1."""
Range = Annotated[tuple[NonNegativeFloat, NonNegativeFloat], AfterValidator(ordered)]
"""A range: lower and upper end, not negative."""
PositiveRange = Annotated[tuple[PositiveFloat, PositiveFloat], AfterValidator(ordered)]
"""A range whose ends are both above 0, the lower end first."""
CountRange = Annotated[tuple[Count, Count], AfterValidator(ordered)]
"""A range of whole numbers from 1; both ends belong to it."""
Limits = tuple[PositiveFloat, ...]
"""One limit for each input, in their order; or empty."""


class Kind(Table, abc.ABC):
    """One kind of excitation draws all inputs of a trajectory. Interface: never instantiated.

    Subclasses are final. Each has a field ``kind`` with its name in recipes.

    Attributes:
        kind: name of the kind; required.
        weight: relative frequency of this kind in the mix that networks learn from. Where a bound
            is learnt and calibrated, and an FMU is measured, all kinds take turns.
        bends: whether inputs are smooth functions of time, curved between samples. Others are
            defined at samples only, and are linear in between.
        jumps: whether inputs change at once, so that moving ones jump between samples where the
            recipe says so (``jumping``).
        drives_axes: whether every input is driven as the position of an axis, within limits of
            its speed and acceleration.
    """

    bends: ClassVar[bool] = False
    jumps: ClassVar[bool] = False
    drives_axes: ClassVar[bool] = False

    weight: float = Field(gt=0)

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse inputs that this kind cannot drive; by default all inputs are accepted.

        Raises:
            ValueError: the inputs do not suit the kind; the message says why, and the remedy.
        """

    def jumping(self, inputs: FloatArray) -> NDArray[np.bool_]:
        """Tell where drawn inputs change at once from the sample before, (N, n_inputs) both.

        By default they do wherever they change, if the kind does so at all.
        """
        jumps = np.zeros(inputs.shape, dtype=bool)
        if self.jumps:
            jumps[1:] = inputs[1:] != inputs[:-1]
        return jumps

    def settings(self) -> dict[str, str]:
        """Return the fields other than ``kind`` and ``weight`` by name, as text for reports.

        A switch that is off is omitted, a range from 0 to 0, and what is not given.
        """
        fields = type(self).model_fields
        off = (name for name, value in self if value is False or value in (None, (0.0, 0.0)))
        left_out = {"kind", "weight", *off}
        chosen = {name: value for name, value in self if name not in left_out}
        return {
            name: _as_text(value, ... in get_args(fields[name].annotation))
            for name, value in chosen.items()
        }

    @abc.abstractmethod
    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        """Describe the inputs in one sentence without its full stop.

        The sentence follows a colon, and describes inputs of amplitude factor 1.

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
            factor: amplitude factor; each kind defines what it multiplies. Above 1, inputs leave
                their range or move faster.
            rng: the only source of randomness.

        Returns:
            Inputs in the units of their signals, time first, then channel: shape (N, n_inputs).
        """


def _as_text(value: object, is_list: bool) -> str:
    """Write the value of a field; a pair of fixed length is written as a range."""
    if isinstance(value, tuple):
        return (", " if is_list else " .. ").join(str(item) for item in value) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


def require_one_each(
    kind: str, name: str, limits: tuple[object, ...], signals: tuple[Signal, ...]
) -> None:
    """Refuse limits of a kind of excitation if there is not exactly one for each input.

    Raises:
        ValueError: the message has the kind, the name of the limits, and the remedy.
    """
    if len(limits) != len(signals):
        raise ValueError(
            f"kind = {kind!r}: {name} has {len(limits)} values; expected {len(signals)}, one for "
            f"each input {[signal.name for signal in signals]}: correct the list"
        )
