"""Signals have names, units and ranges; trajectories are sampled values of signals."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.units import behind

FloatArray = NDArray[np.float64]

LARGEST = 1e300
"""Limit of a range's ends: its width, and what is computed from it, must be finite."""

Hold = Literal["zero_order", "first_order"]
"""The action of an input between samples.

``zero_order``: inputs[k] is constant from t_k to t_k + h. ``first_order``: the value moves
linearly from inputs[k-1] to inputs[k] and reaches inputs[k] at t_k + h.
"""

Angle = Literal["cosine", "sine"]
"""The part of an angle that an input gives. The sine directly follows its cosine."""

UNUSABLE = re.compile(r"[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML cannot hold: control characters, and halves of surrogate pairs."""


@dataclass(frozen=True)
class Signal:
    """A Signal describes one scalar input or output of a system.

    Attributes:
        name: identifier, unique in its system; becomes the FMI variable name.
        unit: unit of the values, as FMI unit name (``"N"``, ``"m"``, ``"rad"``).
        low: smallest value of the intended range, in ``unit``.
        high: largest value of the intended range, in ``unit``.
        description: one line for people.
        start: value before a user sets one, within the range; the value nearest to 0 if None.
        hold: how the signal acts between samples, if it is an input.
        angle: ``"cosine"`` or ``"sine"`` if the input is that of an angle: both then turn on the
            circle between samples. ``check_inputs`` says what a pair needs.
        period: of an input that repeats itself after this value, in ``unit``; inputs in rad or deg
            are angles without it (``period_of``).

    Raises:
        ValueError: XML cannot hold a text, the name is empty, a value is not a number, the range
            is empty or not finite, the start is outside it, the hold or angle is unknown, or the
            period is not positive.
    """

    name: str
    unit: str
    low: float
    high: float
    description: str = ""
    start: float | None = None
    hold: Hold = "zero_order"
    angle: Angle | None = None
    period: float | None = None

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
        for what in ("low", "high", "start", "period"):
            _require_number(self.name, what, getattr(self, what))
        _require_range(self.name, self.unit, self.low, self.high)
        if self.start is not None and not self.low <= self.start <= self.high:
            raise ValueError(
                f"signal {self.name!r}: start {self.start}; expected a value within its range, "
                f"{self.low} .. {self.high}{behind(self.unit)}"
            )
        if self.period is not None and not 0 < self.period < math.inf:
            raise ValueError(
                f"signal {self.name!r}: period {self.period}{behind(self.unit)}; expected a "
                "positive, "
                "finite number, or none"
            )
        for what, word, words in (
            ("hold", self.hold, get_args(Hold)),
            ("angle", self.angle, (*get_args(Angle), None)),
        ):
            if word not in words:
                raise ValueError(
                    f"signal {self.name!r}: {what} {word!r}; expected one of {list(words)}"
                )

    @property
    def start_value(self) -> float:
        """Return the value before a user sets one, in ``unit``."""
        return min(max(0.0, self.low), self.high) if self.start is None else self.start


def _require_range(name: str, unit: str, low: float, high: float) -> None:
    """Refuse a range that is empty or not finite, or whose width would not be finite."""
    about = f"signal {name!r}: range [{low}, {high}]{behind(unit)}"
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ValueError(
            f"{about}; expected two finite numbers, the first smaller than the second"
        )
    if max(abs(low), abs(high)) > LARGEST:
        raise ValueError(
            f"{about}; expected ends between -{LARGEST:g} and {LARGEST:g}, so that the width of "
            "the range, and motions in it, are finite too: narrow it, or choose a larger unit"
        )


def _require_number(name: str, what: str, value: object) -> None:
    """Refuse texts, true and false, and None in a range, where a number is expected."""
    optional = value is None and what not in ("low", "high")
    if not optional and (isinstance(value, bool) or not isinstance(value, Real)):
        raise ValueError(f"signal {name!r}: {what} {value!r}; expected a number")


def within_ranges(signals: Sequence[Signal], values: FloatArray) -> FloatArray:
    """Return values (..., n_signals); values outside their ranges move to the nearest end."""
    low, high = (np.array([getattr(signal, end) for signal in signals]) for end in ("low", "high"))
    return np.clip(values, low, high)


def outside_of_range(signals: Sequence[Signal], values: FloatArray) -> str | None:
    """Name the signal that is furthest outside its range, relative to it; None if all are inside.

    Values have the shape (N, n_signals).
    """
    low, high = (np.array([getattr(signal, end) for signal in signals]) for end in ("low", "high"))
    over = np.maximum(low - values, values - high) / (high - low)
    if not np.any(over > 0.0):
        return None
    sample, channel = np.unravel_index(np.argmax(over), over.shape)
    signal = signals[int(channel)]
    return (
        f"input {signal.name} = {values[sample, channel]:.6g} lies outside of its range "
        f"{signal.low:g}..{signal.high:g}"
    )


PERIODS = {"rad": 2 * math.pi, "deg": 360.0}
"""Full turn in the units of angles."""


def period_of(signal: Signal) -> float | None:
    """Return the period of a signal that is itself an angle, in its unit; None for others."""
    return signal.period or PERIODS.get(signal.unit)


def check_inputs(signals: tuple[Signal, ...]) -> None:
    """Reject inputs whose meanings do not belong together.

    All inputs of a system have the same hold. The sine of an angle follows its cosine, and both
    have the same range, symmetric about 0: its end is the length on the circle.

    Raises:
        ValueError: the message names the signals, what they are and what was expected.
    """
    holds = {signal.name: signal.hold for signal in signals}
    if len(set(holds.values())) > 1:
        raise ValueError(
            f"inputs of several holds, {holds}; expected one for all: where a zero-order hold "
            "must stay, let the system itself hold the value that it reaches"
        )
    for index in range(len(signals)):
        _check_angle(signals, index)


def _check_angle(signals: tuple[Signal, ...], index: int) -> None:
    """Reject a cosine or sine that has no partner, or whose partner has another range."""
    signal, neighbour = signals[index], index + (1 if signals[index].angle == "cosine" else -1)
    if signal.angle is None:
        return
    partner = signals[neighbour] if 0 <= neighbour < len(signals) else None
    if partner is None or partner.angle in (None, signal.angle):
        other, place = ("sine", "behind") if signal.angle == "cosine" else ("cosine", "before")
        raise ValueError(
            f"input {signal.name!r} is the {signal.angle} of an angle; expected its {other} "
            f"directly {place} it: give both, the cosine first"
        )
    ranges = (signal.low, signal.high), (partner.low, partner.high)
    if ranges[0] != ranges[1] or signal.low != -signal.high:
        raise ValueError(
            f"inputs {signal.name!r} and {partner.name!r} are cosine and sine of an angle in the "
            f"ranges {ranges[0]} and {ranges[1]}; expected the same range about 0"
        )


def hold_of(signals: tuple[Signal, ...]) -> Hold:
    """Return the hold of all inputs, of which there is at least one; see ``check_inputs``."""
    return signals[0].hold


def moves(signals: tuple[Signal, ...]) -> bool:
    """Return whether inputs, of which there is at least one, move between samples."""
    return hold_of(signals) == "first_order"


def cosines_of(signals: tuple[Signal, ...]) -> tuple[int, ...]:
    """Return the indices of inputs that are a cosine of an angle; the sine is the next input."""
    return tuple(index for index, signal in enumerate(signals) if signal.angle == "cosine")


def by_axis(signals: Sequence[Signal]) -> list[tuple[Signal, ...]]:
    """Return the inputs of each axis: one of its own, or cosine and sine of an angle."""
    return [
        (signal, signals[index + 1]) if signal.angle == "cosine" else (signal,)
        for index, signal in enumerate(signals)
        if signal.angle != "sine"
    ]


def axis_positions(signals: Sequence[Signal], inputs: FloatArray) -> list[FloatArray]:
    """Return the positions of each axis along inputs, (..., N, n_inputs): (..., N) for each axis.

    The position of an angle, which is given by cosine and sine, is in rad and turns without jumps.
    """
    return [
        inputs[..., index]
        if signal.angle is None
        else np.unwrap(np.arctan2(inputs[..., index + 1], inputs[..., index]))
        for index, signal in enumerate(signals)
        if signal.angle != "sine"
    ]


def on_circles(signals: tuple[Signal, ...], inputs: FloatArray) -> FloatArray:
    """Return inputs, (N, n_inputs), whose cosines and sines are scaled to lie on their circle.

    Their length becomes the end of their range. If both are zero, as halfway between opposite
    directions, the angle is zero.
    """
    scaled = inputs.copy()
    for index in cosines_of(signals):
        pair = scaled[:, index : index + 2]
        pair[~pair.any(axis=1)] = (1.0, 0.0)
        pair *= signals[index].high / np.linalg.norm(pair, axis=1, keepdims=True)
    return scaled


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A Trajectory is a sampled motion: inputs and outputs.

    Sample k belongs to time ``k * step``. ``inputs[k]`` acts from sample k to sample k+1, so a
    trajectory of N inputs has N+1 outputs.

    Attributes:
        step: sample step h in s.
        inputs: shape (N, n_inputs), in the units of the input signals.
        outputs: shape (N + 1, n_outputs), in the units of the output signals.

    Raises:
        ValueError: the shapes do not match.
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
        """The times of the outputs in s, shape (N + 1,)."""
        return self.step * np.arange(len(self.outputs), dtype=np.float64)
