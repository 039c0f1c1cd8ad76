"""Excitations that draw every input on its own.

Each kind gives normalised signals: -1 and 1 are the ends of the input's range.
"""

from __future__ import annotations

import abc
from typing import Literal

import numpy as np
from pydantic import Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.base import CountRange, Kind, PositiveRange, Range


class ChannelKind(Kind):
    """What these kinds share: the range of the amplitude. Interface: never instantiated.

    Attributes:
        amplitude: range of the factor on the normalised signal, drawn uniformly for each input.
    """

    amplitude: Range = (1.0, 1.0)

    @abc.abstractmethod
    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One normalised channel at the sample times, shape (N,)."""

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """All channels, independent, clipped to ``factor`` times the range, shape (N, n_inputs).

        A normalised value v means middle + half range * factor * v.
        """
        columns = []
        for signal in signals:
            normalised = np.clip(rng.uniform(*self.amplitude) * self.signal(time, rng), -1, 1)
            middle, half_range = 0.5 * (signal.high + signal.low), 0.5 * (signal.high - signal.low)
            columns.append(middle + half_range * factor * normalised)
        return np.stack(columns, axis=1)


class HeldRandom(ChannelKind):
    """Independent uniform values, each held for a random number of samples."""

    kind: Literal["held_random"]
    samples: CountRange = (1, 1)

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        count = len(time)
        lengths = rng.integers(self.samples[0], self.samples[1] + 1, count)
        return np.repeat(rng.uniform(-1, 1, count), lengths)[:count]


class MovingAverageRandom(ChannelKind):
    """Uniform random values, weighted over successive samples (the paper authors' code).

    ``coefficients[0]`` weighs the newest value.
    """

    kind: Literal["moving_average_random"]
    coefficients: tuple[float, ...] = Field(min_length=1)

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        values = rng.uniform(-1, 1, len(time) + len(self.coefficients) - 1)
        return np.convolve(values, self.coefficients, mode="valid")


class Harmonic(ChannelKind):
    """One sine with uniform angular frequency in rad/s and random phase."""

    kind: Literal["harmonic"]
    angular_frequency: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        frequency = rng.uniform(*self.angular_frequency)
        return np.asarray(np.sin(frequency * time + rng.uniform(-np.pi, np.pi)))


class Sweep(ChannelKind):
    """A sine whose angular frequency runs linearly through the range, up or down."""

    kind: Literal["sweep"]
    angular_frequency: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        first, last = self.angular_frequency[:: 1 if rng.random() < 0.5 else -1]
        rate = (last - first) / (time[-1] - time[0] + 1e-12)
        elapsed = time - time[0]
        phase = rng.uniform(-np.pi, np.pi) + first * elapsed + 0.5 * rate * elapsed**2
        return np.asarray(np.sin(phase))


class Multisine(ChannelKind):
    """A sum of sines with random frequencies in rad/s and phases; the amplitude is its RMS."""

    kind: Literal["multisine"]
    angular_frequency: PositiveRange
    components: CountRange = (8, 20)

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        count = int(rng.integers(self.components[0], self.components[1] + 1))
        frequency = rng.uniform(*self.angular_frequency, count)
        phase = rng.uniform(-np.pi, np.pi, count)
        total = np.sin(time[:, None] * frequency + phase).sum(axis=1)
        return np.asarray(total * np.sqrt(2 / count))


class Steps(ChannelKind):
    """Uniform levels, each held for a random duration in s."""

    kind: Literal["steps"]
    duration: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        edges = _edges(time, self.duration, rng)
        return rng.uniform(-1, 1, len(edges) + 1)[np.searchsorted(edges, time, side="right")]


class Rest(ChannelKind):
    """Held random values that alternate with rest (input 0); durations of both in s."""

    kind: Literal["rest"]
    duration: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        edges = _edges(time, self.duration, rng)
        active = np.searchsorted(edges, time, side="right") % 2 == 0
        return np.where(active, rng.uniform(-1, 1, len(time)), 0.0)


def _edges(
    time: FloatArray, duration: tuple[float, float], rng: np.random.Generator
) -> FloatArray:
    """Random switching times from the first sample time on, durations uniform in a range."""
    count = int((time[-1] - time[0]) / duration[0]) + 1
    return np.asarray(time[0] + np.cumsum(rng.uniform(*duration, count)))
