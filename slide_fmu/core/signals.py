"""The vocabulary: named signals with units and ranges, and the trajectories made of them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

Hold = Literal["held", "ramp"]
"""How an input acts between samples.

``held``: inputs[k] is constant from t_k to t_k + h. ``ramp``: the value moves linearly from
inputs[k-1] to inputs[k] and reaches inputs[k] at t_k + h.
"""

UNUSABLE = re.compile(r"[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML document can hold: control characters, halves of others."""


@dataclass(frozen=True)
class Signal:
    """One scalar input or output of a system.

    Attributes:
        name: identifier, unique in its system; becomes the FMI variable name.
        unit: unit of the values, as FMI unit name (``"N"``, ``"m"``, ``"rad"``).
        low: smallest value of the intended range, in ``unit``.
        high: largest value of the intended range, in ``unit``.
        description: one line for people.
        start: value before anybody sets one, within the range; the one nearest to 0 if None.

    Raises:
        ValueError: a text is none that XML can hold, the name is empty, the range is empty or not
            finite, or the start outside it.
    """

    name: str
    unit: str
    low: float
    high: float
    description: str = ""
    start: float | None = None

    def __post_init__(self) -> None:
        texts = {"name": self.name, "unit": self.unit, "description": self.description}
        for what, text in texts.items():
            if not isinstance(text, str) or UNUSABLE.search(text):
                raise ValueError(
                    f"signal {self.name!r}: {what} {text!r}; expected text without control "
                    "characters"
                )
        if not self.name or any(character.isspace() for character in self.name):
            raise ValueError(
                f"signal name {self.name!r}: expected a non-empty name without white space"
            )
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise ValueError(
                f"signal {self.name!r}: range [{self.low}, {self.high}] {self.unit}; "
                "expected two finite numbers, the first smaller than the second"
            )
        if self.start is not None and not self.low <= self.start <= self.high:
            raise ValueError(
                f"signal {self.name!r}: start {self.start}; expected a value within its range, "
                f"{self.low} .. {self.high} {self.unit}"
            )

    @property
    def start_value(self) -> float:
        """Value before anybody sets one."""
        return min(max(0.0, self.low), self.high) if self.start is None else self.start


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A sampled motion: what went in and what came out.

    Sample k belongs to time ``k * step``. ``inputs[k]`` acts from sample k to sample k+1, so a
    trajectory of N inputs has N+1 outputs.

    Attributes:
        step: sample step h in s.
        inputs: shape (N, n_inputs), in the units of the input signals.
        outputs: shape (N + 1, n_outputs), in the units of the output signals.

    Raises:
        ValueError: the shapes do not belong together.
    """

    step: float
    inputs: FloatArray
    outputs: FloatArray

    def __post_init__(self) -> None:
        if self.inputs.ndim != 2 or self.outputs.ndim != 2:
            raise ValueError(
                f"trajectory: inputs of shape {self.inputs.shape}, outputs of shape "
                f"{self.outputs.shape}; expected two axes each, time first, then channel"
            )
        if len(self.outputs) != len(self.inputs) + 1:
            raise ValueError(
                f"trajectory: {len(self.inputs)} inputs and {len(self.outputs)} outputs; "
                "expected one output more than inputs (the first is the initial value)"
            )

    @property
    def time(self) -> FloatArray:
        """Times of the outputs in s, shape (N + 1,)."""
        return self.step * np.arange(len(self.outputs), dtype=np.float64)
