"""Physical parameters of a model, such as a mass, have names, units and ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal, get_args

import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.units import behind

Transform = Literal["linear", "log", "reciprocal"]
"""The function of a parameter p that the response follows most evenly: p, its logarithm, or 1/p (a
mass with a force as input)."""

RANGE_SLACK = 1e-6
"""A value may lie outside its range by this fraction of the range, because of rounding."""


@dataclass(frozen=True)
class Parameter:
    """A Parameter is a scalar of a model that users may set within a range.

    Attributes:
        name: identifier, unique among the parameters and signals; becomes the FMI variable name.
        unit: unit of the values, as FMI unit name (``"kg"``).
        low: smallest value, in ``unit``.
        high: largest value, in ``unit``.
        start: value before a user sets one; the middle of the transformed range if None.
        description: one line for people.
        transform: ``"linear"``, ``"log"`` or ``"reciprocal"``.

    Raises:
        ValueError: as for ``Signal``; or the transform is unknown, or needs positive values and
            the range has others.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float | None = None
    description: str = ""
    transform: Transform = "linear"

    def __post_init__(self) -> None:
        try:
            signal = Signal(self.name, self.unit, self.low, self.high, self.description)
        except ValueError as error:
            raise ValueError(str(error).replace("signal", "parameter", 1)) from None
        if self.transform not in get_args(Transform):
            raise ValueError(
                f"parameter {signal.name!r}: transform {self.transform!r}; expected one of "
                f"{list(get_args(Transform))}"
            )
        if self.transform != "linear" and self.low <= 0:
            raise ValueError(
                f"parameter {self.name!r}: transform {self.transform!r} of the range [{self.low}, "
                f"{self.high}]{behind(self.unit)}; expected positive values: give a positive "
                "range, or "
                "the transform 'linear'"
            )
        if self.start is not None and not self.low <= self.start <= self.high:
            raise ValueError(
                f"parameter {self.name!r}: start {self.start}; expected a value within its range, "
                f"{self.low} .. {self.high}{behind(self.unit)}"
            )

    @property
    def start_value(self) -> float:
        """Return the value before a user sets one, in ``unit``."""
        return float(self.unscaled(np.float64(0))) if self.start is None else self.start

    @property
    def signal(self) -> Signal:
        """Return the properties that the parameter shares with inputs and outputs."""
        return Signal(
            self.name, self.unit, self.low, self.high, self.description, self.start_value
        )

    def scaled(self, values: Any) -> Any:
        """Map values in ``unit`` to the transformed range: -1 at ``low`` and 1 at ``high``.

        Arrays keep their shape; complex values are mapped too.
        """
        low, high = self._ends()
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        return (_transformed(self.transform, values) - middle) / half

    def unscaled(self, scaled: Any) -> Any:
        """Map what ``scaled`` gives back to values in ``unit``, of the same shape."""
        low, high = self._ends()
        of_transform = 0.5 * (low + high) + 0.5 * (high - low) * np.asarray(scaled)
        if self.transform == "log":
            return np.exp(of_transform)
        return of_transform if self.transform == "linear" else 1 / of_transform

    def _ends(self) -> tuple[float, float]:
        low, high = (
            float(_transformed(self.transform, np.float64(end))) for end in (self.low, self.high)
        )
        return low, high

    def beyond(self, share: float) -> tuple[float, float]:
        """Return an interval in ``unit`` that is wider than the range by a share at either end.

        The fraction is of the range; with a transform other than ``"linear"``, of its logarithm. A
        range on one side of 0 stays on that side: masses are positive.
        """
        if self.transform != "linear":
            factor = (self.high / self.low) ** share
            return self.low / factor, self.high * factor
        low, high = (
            end + sign * share * (self.high - self.low)
            for sign, end in ((-1, self.low), (1, self.high))
        )
        if self.low >= 0:
            low = max(low, 0.5 * self.low)
        if self.high <= 0:
            high = min(high, 0.5 * self.high)
        return low, high


def _transformed(transform: Transform, values: Any) -> Any:
    if transform == "log":
        return np.log(values)
    return values if transform == "linear" else 1 / values


def starts_of(parameters: tuple[Parameter, ...]) -> FloatArray:
    """Return the start values of parameters, in their units, shape (n_parameters,)."""
    return np.array([parameter.start_value for parameter in parameters], dtype=np.float64)


def grid_of(parameters: tuple[Parameter, ...], share: float = 0.0) -> FloatArray:
    """Return points of a box of parameters in their units, (G, n_parameters), corners among them.

    The box is wider than the ranges by a share at either end (``Parameter.beyond``). With few
    parameters there are middles too: five points for one, three each for two or three.
    """
    count = {1: 5, 2: 3, 3: 3}.get(len(parameters), 2)
    axes = []
    for parameter in parameters:
        first, last = parameter.beyond(share) if share else (parameter.low, parameter.high)
        ends = parameter.scaled(first), parameter.scaled(last)
        axes.append(parameter.unscaled(np.linspace(*ends, count)))
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(parameters))


def corners_of(parameters: tuple[Parameter, ...]) -> list[dict[str, float]]:
    """Return the values at all corners of the box of the ranges, by name, in a fixed order."""
    names = [parameter.name for parameter in parameters]
    ends = [(parameter.low, parameter.high) for parameter in parameters]
    return [dict(zip(names, corner, strict=True)) for corner in product(*ends)]


def checked_values(parameters: tuple[Parameter, ...], given: Mapping[str, float]) -> FloatArray:
    """Return the values of parameters, shape (n_parameters,); missing ones have start values.

    Values that rounding moved out of the range are set to its end.

    Raises:
        ValueError: a name is unknown, or a value is not a number within its range.
    """
    names = [parameter.name for parameter in parameters]
    unknown = [name for name in given if name not in names]
    if unknown:
        raise ValueError(
            f"parameter {unknown[0]!r}; expected one of {names}"
            if names
            else f"parameter {unknown[0]!r}; the surrogate has no parameters: give none, or learn "
            "one with a table parameters in its recipe"
        )
    return np.array(
        [_checked(parameter, given.get(parameter.name)) for parameter in parameters],
        dtype=np.float64,
    )


def _checked(parameter: Parameter, value: float | None) -> float:
    if value is None:
        return parameter.start_value
    slack = RANGE_SLACK * (parameter.high - parameter.low)
    number = isinstance(value, int | float | np.number) and math.isfinite(value)
    if not number or not parameter.low - slack <= value <= parameter.high + slack:
        raise ValueError(
            f"parameter {parameter.name!r} = {shown(value)}{behind(parameter.unit)}; expected a "
            "number in its "
            f"range, {parameter.low:g} .. {parameter.high:g}{behind(parameter.unit)}: outside, "
            "errors "
            "grow fast; learn a surrogate with a wider range"
        )
    return min(max(float(value), parameter.low), parameter.high)
