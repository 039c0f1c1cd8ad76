"""Kinds of excitation describe themselves; the parts of their sentences are worded here."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.core.signals import Signal
from slide_fmu.core.units import ratio


def between(pair: tuple[float, float], unit: str = "") -> str:
    """Return a range such as ``0.3 to 2 s``, or one value if both ends are equal."""
    low, high = pair
    numbers = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return with_unit(numbers, unit)


def with_unit(numbers: str, unit: str) -> str:
    """Return numbers with their unit; without one if they are dimensionless."""
    return numbers if unit in ("", "1") else f"{numbers} {unit}"


def listed(values: Sequence[float], signals: tuple[Signal, ...], per: str) -> str:
    """Return one limit for each input, such as ``1.5 and 2 rad/s``; equal units are given once.

    Args:
        values: the limits, in the order of the inputs.
        signals: the inputs.
        per: the divisor of their units, such as ``s^2``.
    """
    units = [ratio(signal.unit, per) for signal in signals]
    if len(set(units)) == 1:
        return with_unit(_enumerated([f"{value:g}" for value in values]), units[0])
    return _enumerated([with_unit(f"{v:g}", unit) for v, unit in zip(values, units, strict=True)])


def _enumerated(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def subject(signals: tuple[Signal, ...]) -> str:
    """Return the subject of a sentence: the only input, the only angle, or every input."""
    if len(signals) == 1:
        return signals[0].name
    if _is_one_angle(signals):
        return f"the angle of {signals[0].name} and {signals[1].name}"
    return "every input on its own"


def size(amplitude: tuple[float, float], signals: tuple[Signal, ...]) -> str:
    """Return how far normalised values of an amplitude reach from the middle of the range.

    For one input it is in its unit. For several it is a share of half the range of each.
    """
    middle = 0.5 * (signals[0].high + signals[0].low)
    if len(signals) == 1 and middle:
        unit = signals[0].unit
        return f"{distance(amplitude, signals)} about {with_unit(f'{middle:g}', unit)}"
    if _is_one_angle(signals):
        return f"{distance(amplitude, signals)} about any angle"
    return distance(amplitude, signals)


def distance(parts: tuple[float, float], signals: tuple[Signal, ...]) -> str:
    """Return a range of parts of half the range of the inputs, as ``size``, from wherever."""
    if len(signals) == 1:
        (signal,) = signals
        low, high = (0.5 * (signal.high - signal.low) * end for end in parts)
        return between((low, high), signal.unit)
    if _is_one_angle(signals):
        return f"{between((180 * parts[0], 180 * parts[1]))} deg"
    return f"{between((100 * parts[0], 100 * parts[1]))} % of half its range"


def _is_one_angle(signals: tuple[Signal, ...]) -> bool:
    return [signal.angle for signal in signals] == ["cosine", "sine"]
