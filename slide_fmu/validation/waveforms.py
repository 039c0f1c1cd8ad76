"""Waveforms are single channels of inputs as users set them, as functions of time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, final, runtime_checkable

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.speed_profile import SpeedProfiles, fastest_phases


class Waveform(Protocol):
    """A Waveform is one channel over time."""

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the values at times in s, (N,)."""


@runtime_checkable
class Tonal(Protocol):
    """A Tonal waveform has one frequency."""

    @property
    def amplitude(self) -> float:
        """Half of what lies between its ends."""

    @property
    def hz(self) -> float:
        """Its frequency in Hz."""


@final
@dataclass(frozen=True)
class Tone:
    """A Tone is a sine about a level; its angular frequency is in rad/s."""

    level: float
    amplitude: float
    frequency: float
    phase: float

    @property
    def hz(self) -> float:
        """Its frequency in Hz."""
        return self.frequency / (2 * math.pi)

    def __call__(self, time: FloatArray) -> FloatArray:
        return self.level + self.amplitude * np.sin(self.frequency * time + self.phase)


@final
@dataclass(frozen=True)
class StoppedTone:
    """A StoppedTone is a tone that stays where it is from a time in s on, and ends at rest.

    Attributes:
        tone: the tone.
        at: when it stops.
        until: when the input is released.
        rest: to which value.
    """

    tone: Tone
    at: float
    until: float
    rest: float

    @property
    def amplitude(self) -> float:
        """That of its tone."""
        return self.tone.amplitude

    @property
    def hz(self) -> float:
        """That of its tone."""
        return self.tone.hz

    def __call__(self, time: FloatArray) -> FloatArray:
        before_stop = self.tone(np.minimum(time, self.at))
        return np.where(time < self.until, before_stop, self.rest)


@final
@dataclass(frozen=True)
class Triangle:
    """A Triangle goes straight to and fro between two values.

    Its angular frequency is in rad/s.
    """

    low: float
    high: float
    frequency: float
    phase: float

    @property
    def amplitude(self) -> float:
        """Half of what lies between its ends."""
        return 0.5 * (self.high - self.low)

    @property
    def hz(self) -> float:
        """Its frequency in Hz."""
        return self.frequency / (2 * math.pi)

    def __call__(self, time: FloatArray) -> FloatArray:
        turn = np.mod((self.frequency * time + self.phase) / (2 * np.pi), 1.0)
        return np.asarray(self.low + (self.high - self.low) * np.abs(2 * turn - 1))


@final
@dataclass(frozen=True)
class HeldLevels:
    """HeldLevels are held one after the other, each for a time in s, and again."""

    levels: tuple[float, ...]
    times: tuple[float, ...]

    def __call__(self, time: FloatArray) -> FloatArray:
        ends = np.cumsum(self.times)
        # a sample at the end of a level, but for rounding, belongs to the next one
        phase = np.mod(time + 1e-9 * ends[-1], ends[-1])
        index = np.minimum(np.searchsorted(ends, phase, side="right"), len(ends) - 1)
        return np.asarray(np.array(self.levels)[index])


@final
@dataclass(frozen=True)
class RepeatedMoves:
    """RepeatedMoves go to and fro by the same way, with rests between.

    The speed is a trapezoid in time, or a triangle.

    Attributes:
        start: position before the first move.
        way: way of the first move, with its sign.
        speed, acceleration: their largest values.
        rest: time in s between moves.
    """

    start: float
    way: float
    speed: float
    acceleration: float
    rest: float

    def __call__(self, time: FloatArray) -> FloatArray:
        (to_speed, _), (even, _), _ = fastest_phases(
            abs(self.way), 0.0, self.speed, self.acceleration
        )
        lasts = 2 * to_speed + even
        index = np.floor(time / (lasts + self.rest))
        phase = np.minimum((time - index * (lasts + self.rest)) / lasts, 1.0)
        done = SpeedProfiles.sharp(np.array([to_speed / lasts])).way(phase[None])[0]
        back = np.mod(index, 2) == 1
        return np.asarray(self.start + self.way * np.where(back, 1.0 - done, done))
