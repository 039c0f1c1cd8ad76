"""Inputs as users set them: tones, offsets, holds and moves, each of few numbers that are named.

A random trajectory of a recipe hardly ever holds a tone, a level or a limit for long. Users do.
Each input here follows from a point of a unit cube, so that a search can look near a point. All
numbers are rounded before they are used: words with four digits repeat the input. Motions, which
are angles and inputs that a recipe drives as axes, stay within the speeds and accelerations that
its excitation declares.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import ratio
from slide_fmu.excitation.point_to_point import trapezoid_way
from slide_fmu.excitation.words import with_unit
from slide_fmu.validation.user_channels import Channel

DIGITS = 4
"""Numbers of an input have this many digits, unless they are a limit; levels, of their range."""

MARGIN = 1.0 - 10.0 ** (1 - DIGITS)
"""Tones use this part of what limits allow, so that rounding does not exceed them."""

SIZES = (0.05, 1.0)
"""Range of the sum of all tones, as a part of what limits allow."""

MOST_TONES = 4
"""A sum of tones has two to this number of them."""

MOST_OFFSET = 0.9
"""Largest offset, as a part of half the range, or of the speed of an angle."""

LEAST_HOLD = 0.3
"""Least level that is held, as a part of half the range."""

DISTANCES = (0.003, 1.0)
"""Range of the length of a move, as a part of its axis' range."""

MOST_TURNS = 5.0
"""Longest move of an angle, in turns."""

LEAST_EFFORT = 0.2
"""Least part of the limits of speed and acceleration that moves with rests use."""

COORDINATES = 4 + 3 * MOST_TONES
"""Each channel has this number of coordinates in the unit cube."""


class Waveform(Protocol):
    """A Waveform is one channel over time."""

    def values(self, time: FloatArray) -> FloatArray:
        """Return the values at times in s, (N,)."""

    def words(self, unit: str) -> str:
        """Return a text by which it can be repeated, with t in s, and values in a unit."""


@dataclass(frozen=True)
class Tone:
    """A Tone is a sine; its angular frequency is in rad/s, and its phase in rad."""

    amplitude: float
    frequency: float
    phase: float


@dataclass(frozen=True)
class Tones:
    """Tones are sines about a level, which moves at a constant rate. Final."""

    level: float
    rate: float
    tones: tuple[Tone, ...]

    def values(self, time: FloatArray) -> FloatArray:
        found = self.level + self.rate * time
        for tone in self.tones:
            found = found + tone.amplitude * np.sin(tone.frequency * time + tone.phase)
        return np.asarray(found)

    def words(self, unit: str) -> str:
        parts = [with_unit(f"{self.level:.10g}", unit)] if self.level else []
        if self.rate:
            parts.append(f"{with_unit(f'{self.rate:.10g}', ratio(unit, 's'))} t")
        parts += [
            f"{with_unit(f'{tone.amplitude:.10g}', unit)} "
            f"sin({tone.frequency:.10g} t + {tone.phase:.10g})"
            for tone in self.tones
        ]
        return f"= {' + '.join(parts)}".replace("+ -", "- ")


@dataclass(frozen=True)
class Levels:
    """Levels are held one after the other, each for a time in s, and again. Final."""

    levels: tuple[float, ...]
    times: tuple[float, ...]

    def values(self, time: FloatArray) -> FloatArray:
        ends = np.cumsum(self.times)
        # a sample at the end of a level, but for rounding, belongs to the next one
        phase = np.mod(time + 1e-9 * ends[-1], ends[-1])
        index = np.minimum(np.searchsorted(ends, phase, side="right"), len(ends) - 1)
        return np.asarray(np.array(self.levels)[index])

    def words(self, unit: str) -> str:
        held = [
            f"{with_unit(f'{level:.10g}', unit)} for {time:.10g} s"
            for level, time in zip(self.levels, self.times, strict=True)
        ]
        return f"= {', then '.join(held)}, and so on"


@dataclass(frozen=True)
class Constant:
    """A Constant is one level. Final."""

    level: float

    def values(self, time: FloatArray) -> FloatArray:
        return np.full(len(time), self.level)

    def words(self, unit: str) -> str:
        return f"= {with_unit(f'{self.level:.10g}', unit)}"


@dataclass(frozen=True)
class RepeatedMoves:
    """RepeatedMoves go to and fro, or always on, each by the same way, with rests between. Final.

    The speed is a trapezoid in time, or a triangle.

    Attributes:
        start: position before the first move.
        way: way of the first move, with its sign.
        speed, acceleration: their largest values.
        rest: time in s between moves.
        onward: whether all moves go the same way.
    """

    start: float
    way: float
    speed: float
    acceleration: float
    rest: float
    onward: bool

    def values(self, time: FloatArray) -> FloatArray:
        way, to_speed = abs(self.way), self.speed / self.acceleration
        if way > self.speed * to_speed:
            lasts = way / self.speed + to_speed
        else:
            to_speed = math.sqrt(way / self.acceleration)
            lasts = 2 * to_speed
        index = np.floor(time / (lasts + self.rest))
        phase = np.minimum((time - index * (lasts + self.rest)) / lasts, 1.0)
        done = trapezoid_way(phase, np.full(len(time), min(to_speed / lasts, 0.5)))
        if self.onward:
            return np.asarray(self.start + self.way * (index + done))
        back = np.mod(index, 2) == 1
        return np.asarray(self.start + self.way * np.where(back, 1.0 - done, done))

    def words(self, unit: str) -> str:
        end = with_unit(f"{self.start + self.way:.10g}", unit)
        way = f"on by {with_unit(f'{self.way:.10g}', unit)} again and again"
        rests = f", and rests {self.rest:.10g} s after each move" if self.rest else ""
        return (
            f"moves from {with_unit(f'{self.start:.10g}', unit)} "
            f"{way if self.onward else f'to {end} and back'}, at up to "
            f"{with_unit(f'{self.speed:.10g}', ratio(unit, 's'))} and "
            f"{with_unit(f'{self.acceleration:.10g}', ratio(unit, 's^2'))}{rests}"
        )


@dataclass(frozen=True)
class UserInput:
    """A UserInput is one waveform for each channel; the kind is named in words."""

    kind: str
    channels: tuple[Channel, ...]
    waveforms: tuple[Waveform, ...]

    def inputs(self, time: FloatArray) -> FloatArray:
        """Return the inputs at times in s, (N,), in their units, shape (N, n_inputs)."""
        pairs = zip(self.channels, self.waveforms, strict=True)
        return np.concatenate(
            [one.columns(waveform.values(time)) for one, waveform in pairs], axis=1
        )

    @property
    def bends(self) -> bool:
        """Whether it is curved between samples; jumps and the ramps of moves are not."""
        return any(isinstance(waveform, Tones) for waveform in self.waveforms)

    @property
    def words(self) -> str:
        """A text by which the inputs can be repeated."""
        pairs = zip(self.channels, self.waveforms, strict=True)
        return "; ".join(f"{one.name} {waveform.words(one.unit)}" for one, waveform in pairs)


@dataclass(frozen=True, eq=False)
class Point:
    """A Point is where a search is: a kind of input, and coordinates from 0 to 1.

    Attributes:
        kind: one of ``KINDS``.
        place: coordinates, (n_channels + 1, COORDINATES); the last row says which channels are
            driven.
    """

    kind: str
    place: FloatArray

    @classmethod
    def random(cls, kind: str, channels: int, rng: np.random.Generator) -> Point:
        """Draw a point of a kind."""
        return cls(kind, rng.random((channels + 1, COORDINATES)))

    def near(self, size: float, rng: np.random.Generator) -> Point:
        """Draw a point near this one, with the standard deviation of each coordinate.

        Coordinates are reflected at the faces of the cube. The same channels are driven.
        """
        place = self.place + size * rng.normal(size=self.place.shape)
        place = np.abs(np.mod(place + 1.0, 2.0) - 1.0)
        place[-1] = self.place[-1]
        return Point(self.kind, place)

    def user_input(self, channels: tuple[Channel, ...]) -> UserInput:
        """Return the input of this point."""
        alone, which = self.place[-1, :2]
        driven = int(which * len(channels)) if alone < 0.5 else None
        waveforms = []
        for index, channel in enumerate(channels):
            coordinates = iter(self.place[index].tolist())
            kept = driven is not None and index != driven
            waveforms.append((_kept if kept else KINDS[self.kind][0])(channel, coordinates))
        _, still, moving = KINDS[self.kind]
        names = moving if any(channel.speed is not None for channel in channels) else still
        return UserInput(names, channels, tuple(waveforms))


def _kept(channel: Channel, u: Iterator[float]) -> Waveform:
    return Constant(_position(channel, u))


def _tone(channel: Channel, u: Iterator[float]) -> Waveform:
    level = _middle(channel) if channel.speed is None else _position(channel, u)
    return _about(channel, level, 0.0, 1, u)


def _tones(channel: Channel, u: Iterator[float]) -> Waveform:
    count = 2 + int((MOST_TONES - 1) * next(u))
    level = _middle(channel) if channel.speed is None else _position(channel, u)
    return _about(channel, level, 0.0, count, u)


def _offset(channel: Channel, u: Iterator[float]) -> Waveform:
    """Return tones about an offset; for an angle the offset is a speed."""
    count, place = 1 + int((MOST_TONES - 1) * next(u)), MOST_OFFSET * (2 * next(u) - 1)
    if channel.turns and channel.speed is not None:
        rate = _rounded(place * channel.speed)
        return _about(channel, _position(channel, u), rate, count, u)
    half = 0.5 * (channel.high - channel.low)
    level = _in_range(channel, _middle(channel) + place * half)
    return _about(channel, level, 0.0, count, u)


def _holds(channel: Channel, u: Iterator[float]) -> Waveform:
    if channel.speed is not None:
        return _moves(channel, LEAST_EFFORT, u)
    part = LEAST_HOLD + (1.0 - LEAST_HOLD) * next(u)
    end = channel.high if next(u) < 0.5 else channel.low
    level = _middle(channel) + part * (end - _middle(channel))
    return Levels(
        (_in_range(channel, level), channel.rest), (_time(channel, u), _time(channel, u))
    )


def _limits(channel: Channel, u: Iterator[float]) -> Waveform:
    if channel.speed is not None:
        return _moves(channel, 1.0, u)
    ends = (channel.high, channel.low) if next(u) < 0.5 else (channel.low, channel.high)
    first, other, equal = _time(channel, u), _time(channel, u), next(u) < 0.5
    return Levels(ends, (first, first if equal else other))


KINDS: dict[str, tuple[Callable[[Channel, Iterator[float]], Waveform], str, str]] = {
    "tone": (_tone, "a steady tone", "a steady tone"),
    "tones": (_tones, "a sum of few tones", "a sum of few tones"),
    "offset": (_offset, "an offset with tones", "an offset with tones"),
    "holds": (_holds, "holds and releases", "moves and rests"),
    "limits": (_limits, "switches between the limits", "moves at the limits"),
}
"""Kinds of input: how one is made of coordinates, and its name, of inputs and of motions."""


def _about(channel: Channel, level: float, rate: float, count: int, u: Iterator[float]) -> Tones:
    """Return tones about a level that moves at a rate, within the limits of their sum."""
    total = SIZES[0] + (SIZES[1] - SIZES[0]) * next(u)
    drawn = [(_frequency(channel, next(u)), 0.2 + 0.8 * next(u), next(u)) for _ in range(count)]
    most = math.pi if channel.turns else min(level - channel.low, channel.high - level)
    shares = np.array([weight for _, weight, _ in drawn])
    rates = np.array([frequency for frequency, _, _ in drawn])
    allowed = [most / shares.sum()]
    if channel.speed is not None and channel.acceleration is not None:
        allowed.append((channel.speed - abs(rate)) / float(shares @ rates))
        allowed.append(channel.acceleration / float(shares @ rates**2))
    amplitudes = MARGIN * total * min(allowed) * shares
    return Tones(
        level,
        rate,
        tuple(
            Tone(_rounded(amplitude), frequency, _rounded(2 * math.pi * phase))
            for amplitude, (frequency, _, phase) in zip(amplitudes, drawn, strict=True)
        ),
    )


def _moves(channel: Channel, effort: float, u: Iterator[float]) -> RepeatedMoves:
    """Return moves which use at least a part of the limits; those that use all never rest."""
    assert channel.speed is not None
    assert channel.acceleration is not None
    start, part = _position(channel, u), _logarithmic(DISTANCES, next(u))
    sign, onward = 1.0 if next(u) < 0.5 else -1.0, channel.turns and next(u) < 0.5
    if channel.turns:
        way = _rounded(sign * part * MOST_TURNS * 2 * math.pi)
    else:
        ends = [start + sign * part * (channel.high - channel.low) for sign in (sign, -sign)]
        inside = [end for end in ends if channel.low <= end <= channel.high]
        furthest = channel.high if start < _middle(channel) else channel.low
        way = _in_range(channel, inside[0] if inside else furthest) - start
    speed, acceleration = (
        limit if effort == 1.0 else _rounded(MARGIN * limit * _logarithmic((effort, 1.0), next(u)))
        for limit in (channel.speed, channel.acceleration)
    )
    rest = 0.0 if effort == 1.0 else _time(channel, u)
    return RepeatedMoves(start, way, speed, acceleration, rest, onward)


def _position(channel: Channel, u: Iterator[float]) -> float:
    low, high = (-math.pi, math.pi) if channel.turns else (channel.low, channel.high)
    value = low + (high - low) * next(u)
    return _rounded(value) if channel.turns else _in_range(channel, value)


def _middle(channel: Channel) -> float:
    return 0.0 if channel.turns else 0.5 * (channel.low + channel.high)


def _in_range(channel: Channel, value: float) -> float:
    """Round a value to digits of the range, but not out of it."""
    decimals = DIGITS - 1 - math.floor(math.log10(channel.high - channel.low))
    return min(max(round(value, decimals), channel.low), channel.high)


def _frequency(channel: Channel, u: float) -> float:
    """Return a frequency; slow ones are more frequent, though less than in a logarithmic scale."""
    low, high = (math.sqrt(end) for end in channel.frequencies)
    return _rounded((low + u * (high - low)) ** 2)


def _time(channel: Channel, u: Iterator[float]) -> float:
    return _rounded(_logarithmic(channel.times, next(u)))


def _logarithmic(ends: tuple[float, float], u: float) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** u)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
