"""These kinds of excitation draw every input independently of the others.

Each kind draws one normalised channel at a time: -1 and 1 are the ends of the input's range.
Values beyond are clipped. Cosine and sine of an angle are drawn together, to remain an angle.
Some kinds change at once: held inputs jump at samples. Moving ones jump at any time where the
recipe says so (``data.jumps``), and go straight from sample to sample elsewhere.
"""

from __future__ import annotations

import abc
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.base import CountRange, Kind, PositiveRange, Range
from slide_fmu.excitation.descriptions import between, distance, size, subject


class ChannelKind(Kind):
    """A ChannelKind draws each input independently. Interface: never instantiated.

    Attributes:
        amplitude: range of the factor on the normalised signal; it is drawn uniformly, separately
            for each input. Values beyond an input's range are clipped to its ends.
        offset: range of a constant of random sign that is added, as a part of half the range of
            the input; it is drawn uniformly, separately for each input.
    """

    amplitude: Range = (1.0, 1.0)
    offset: Range = (0.0, 0.0)

    def size(self, signals: tuple[Signal, ...]) -> str:
        """Return how far the inputs reach from where, as a part of their description."""
        about = f", about an offset of {distance(self.offset, signals)}"
        return size(self.amplitude, signals) + (about if self.offset[1] else "")

    @abc.abstractmethod
    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draw one normalised channel, shape (N,), at times in s, evenly spaced, shape (N,)."""

    def scaled(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draw one normalised channel with its amplitude and offset; it may leave -1 .. 1."""
        values = rng.uniform(*self.amplitude) * self.signal(time, rng)
        if self.offset[1] == 0:
            return values
        return values + rng.uniform(*self.offset) * (1 if rng.random() < 0.5 else -1)

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw all channels, independent of each other, clipped to ``factor`` times the range.

        A normalised value v means the middle of the range plus half the range * factor * v. Cosine
        and sine are one channel, whose angle is a random one plus half a turn * factor * v.
        """
        columns = []
        for signal in signals:
            if signal.angle == "sine":
                continue  # it was drawn with its cosine, the signal before
            normalised = np.clip(self.scaled(time, rng), -1, 1)
            if signal.angle == "cosine":
                angle = rng.uniform(-np.pi, np.pi) + np.pi * factor * normalised
                columns += [signal.high * np.cos(angle), signal.high * np.sin(angle)]
                continue
            middle, half_range = 0.5 * (signal.high + signal.low), 0.5 * (signal.high - signal.low)
            columns.append(middle + half_range * factor * normalised)
        return np.stack(columns, axis=1)


class HeldRandom(ChannelKind):
    """The input takes independent uniform values, each for a random number of samples.

    Attributes:
        samples: range of the number of samples, with both its ends; [1, 1] is white noise.
    """

    jumps: ClassVar[bool] = True
    kind: Literal["held_random"]
    samples: CountRange = (1, 1)

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        time = between((step * self.samples[0], step * self.samples[1]), "s")
        largest = self.size(signals)
        return f"{subject(signals)} takes random values of up to {largest}, each for {time}"

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        count = len(time)
        lengths = rng.integers(self.samples[0], self.samples[1] + 1, count)
        return np.repeat(rng.uniform(-1, 1, count), lengths)[:count]


class MovingAverageRandom(ChannelKind):
    """The input is uniform white noise through a FIR filter, as in the paper's code.

    Attributes:
        coefficients: weights of the filter; the first one is for the newest value.
    """

    kind: Literal["moving_average_random"]
    coefficients: tuple[float, ...] = Field(min_length=1)

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        return (
            f"{subject(signals)} is a weighted sum of the last {len(self.coefficients)} random "
            f"values of up to {self.size(signals)}, one every {step:g} s"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        values = rng.uniform(-1, 1, len(time) + len(self.coefficients) - 1)
        return np.convolve(values, self.coefficients, mode="valid").astype(np.float64)


class Steps(ChannelKind):
    """The input steps between uniform random levels.

    Attributes:
        duration: range in s of the time for which each level is held.
    """

    jumps: ClassVar[bool] = True
    kind: Literal["steps"]
    duration: PositiveRange

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        return (
            f"{subject(signals)} steps between random levels of up to "
            f"{self.size(signals)}, each for {between(self.duration, 's')}"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        return _levels(time, self.duration, rng)


class Ramps(ChannelKind):
    """The input goes between uniform random levels, straight within one sample step.

    The values at the samples are those of ``steps``; a moving input never jumps in this kind.

    Attributes:
        duration: range in s of the time from one move to the next.
    """

    kind: Literal["ramps"]
    duration: PositiveRange

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        return (
            f"{subject(signals)} goes to random levels of up to {self.size(signals)}, "
            f"each within {step:g} s, and stays there for {between(self.duration, 's')}"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        return _levels(time, self.duration, rng)


class Stops(ChannelKind):
    """The input moves as a sum of sines, stops at once, pauses, and goes on at once.

    So do inputs with an emergency stop, a release, or a switch. In a pause, the normalised value
    is 0 or a random one, with the same probability.

    Attributes:
        angular_frequency: range in rad/s; the logarithm of every frequency is drawn uniformly.
        components: range of the number of sines, with both its ends.
        duration: range in s of the length of every motion and of every pause.
    """

    jumps: ClassVar[bool] = True
    kind: Literal["stops"]
    angular_frequency: PositiveRange
    duration: PositiveRange
    components: CountRange = (1, 3)

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        time = between(self.duration, "s")
        return (
            f"{subject(signals)} moves by up to {self.size(signals)} in sums of sines "
            f"of {between(self.angular_frequency)} rad/s for {time}, stops at once for {time}, "
            "and so on"
        )

    def jumping(self, inputs: FloatArray) -> NDArray[np.bool_]:
        """Tell where a pause begins or ends: where a change has a rest on one side, (N, n)."""
        changes = super().jumping(inputs)
        rests = ~changes
        before = np.concatenate([rests[:1], rests[:-1]])
        after = np.concatenate([rests[1:], rests[-1:]])
        return np.asarray(changes & (before | after))

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        edges = _edges(time, self.duration, rng)
        number = np.searchsorted(edges, time, side="right")
        levels = rng.uniform(-1, 1, len(edges) + 1) * (rng.random(len(edges) + 1) < 0.5)
        count = int(rng.integers(self.components[0], self.components[1] + 1))
        slowest, fastest = np.log(self.angular_frequency)
        frequency = np.exp(rng.uniform(slowest, fastest, count))
        phase = rng.uniform(-np.pi, np.pi, count)
        sines = np.sin(time[:, None] * frequency + phase).mean(axis=1)
        moving = (number + int(rng.integers(2))) % 2 == 0
        return np.where(moving, sines, levels[number])


class Binary(ChannelKind):
    """The input switches between both ends of its range.

    It is the random binary signal of system identification: with several inputs, every combination
    of their ends occurs.

    Attributes:
        duration: range in s of the time at an end.
    """

    jumps: ClassVar[bool] = True
    kind: Literal["binary"]
    duration: PositiveRange

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        return (
            f"{subject(signals)} switches between plus and minus {self.size(signals)}, "
            f"each for {between(self.duration, 's')}"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        edges = _edges(time, self.duration, rng)
        sign = rng.choice([-1.0, 1.0])
        return np.asarray(sign * (1.0 - 2.0 * (np.searchsorted(edges, time, side="right") % 2)))


class Rest(ChannelKind):
    """The input alternates between uniform white noise and rest.

    Attributes:
        duration: range in s of the length of every part, with noise or at rest. At rest the
            normalised value is 0: the input stays in the middle of its range.
    """

    kind: Literal["rest"]
    duration: PositiveRange

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        time = between(self.duration, "s")
        return (
            f"{subject(signals)} takes random values of up to {self.size(signals)}, "
            f"one every {step:g} s, for {time}, then rests for {time}, and so on"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        edges = _edges(time, self.duration, rng)
        active = np.searchsorted(edges, time, side="right") % 2 == 0
        return np.where(active, rng.uniform(-1, 1, len(time)), 0.0)


def _levels(
    time: FloatArray, duration: tuple[float, float], rng: np.random.Generator
) -> FloatArray:
    """Draw uniform random levels from -1 to 1, each for a duration in s, shape (N,)."""
    edges = _edges(time, duration, rng)
    return rng.uniform(-1, 1, len(edges) + 1)[np.searchsorted(edges, time, side="right")]


def _edges(
    time: FloatArray, duration: tuple[float, float], rng: np.random.Generator
) -> FloatArray:
    """Draw switching times in s, shape (n,), at least until the last sample time."""
    count = int((time[-1] - time[0]) / duration[0]) + 1
    return np.asarray(time[0] + np.cumsum(rng.uniform(*duration, count)))
