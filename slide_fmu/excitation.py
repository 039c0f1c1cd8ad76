"""Excitations: what drives the inputs of a trajectory.

Every kind gives normalised signals (-1 and 1 are the ends of the input's range) of shape
(n_samples, n_inputs), all channels drawn independently.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from slide_fmu.signals import FloatArray, Signal


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if not 0 <= pair[0] <= pair[1]:
        raise ValueError("expected two numbers, not negative, the smaller one first")
    return pair


def _ordered_counts(pair: tuple[int, int]) -> tuple[int, int]:
    if pair[0] > pair[1]:
        raise ValueError("expected two numbers, the smaller one first")
    return pair


Range = Annotated[tuple[float, float], AfterValidator(_ordered)]
PositiveRange = Annotated[
    tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0)]], AfterValidator(_ordered)
]
CountRange = Annotated[
    tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]],
    AfterValidator(_ordered_counts),
]


class _Kind(BaseModel):
    """What all kinds share: a weight in the mix and the range of the amplitude."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    weight: float = Field(gt=0)
    amplitude: Range = (1.0, 1.0)


class HeldRandom(_Kind):
    """Independent uniform values, each held for a random number of samples."""

    kind: Literal["held_random"]
    samples: CountRange = (1, 1)

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        count = len(time)
        lengths = rng.integers(self.samples[0], self.samples[1] + 1, count)
        return np.repeat(rng.uniform(-1, 1, count), lengths)[:count]


class MovingAverageRandom(_Kind):
    """Uniform random values, weighted over successive samples (the paper authors' code).

    ``coefficients[0]`` weighs the newest value.
    """

    kind: Literal["moving_average_random"]
    coefficients: tuple[float, ...] = Field(min_length=1)

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        values = rng.uniform(-1, 1, len(time) + len(self.coefficients) - 1)
        return np.convolve(values, self.coefficients, mode="valid")


class Harmonic(_Kind):
    """One sine with uniform angular frequency in rad/s and random phase."""

    kind: Literal["harmonic"]
    angular_frequency: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        frequency = rng.uniform(*self.angular_frequency)
        return np.asarray(np.sin(frequency * time + rng.uniform(-np.pi, np.pi)))


class Sweep(_Kind):
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


class Multisine(_Kind):
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


class Steps(_Kind):
    """Uniform levels, each held for a random duration in s."""

    kind: Literal["steps"]
    duration: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        edges = _edges(time, self.duration, rng)
        return rng.uniform(-1, 1, len(edges) + 1)[np.searchsorted(edges, time, side="right")]


class Rest(_Kind):
    """Held random values that alternate with rest (input 0); durations of both in s."""

    kind: Literal["rest"]
    duration: PositiveRange

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One channel at the sample times."""
        edges = _edges(time, self.duration, rng)
        active = np.searchsorted(edges, time, side="right") % 2 == 0
        return np.where(active, rng.uniform(-1, 1, len(time)), 0.0)


Excitation = Annotated[
    HeldRandom | MovingAverageRandom | Harmonic | Sweep | Multisine | Steps | Rest,
    Field(discriminator="kind"),
]


def draw_inputs(
    kind: Excitation,
    signals: tuple[Signal, ...],
    time: FloatArray,
    factor: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw one realisation of an excitation.

    Args:
        signals: the inputs; a normalised value v means middle + half range * v.
        time: sample times in s, shape (N,).
        factor: multiplies what was drawn; above 1 the inputs leave their range.

    Returns:
        Inputs in their units, shape (N, n_inputs), clipped to ``factor`` times the range.
    """
    columns = []
    for signal in signals:
        normalised = np.clip(rng.uniform(*kind.amplitude) * kind.signal(time, rng), -1, 1)
        middle, half_range = 0.5 * (signal.high + signal.low), 0.5 * (signal.high - signal.low)
        columns.append(middle + half_range * factor * normalised)
    return np.stack(columns, axis=1)


def choose_kind(kinds: tuple[Excitation, ...], rng: np.random.Generator) -> int:
    """Draw the index of a kind by the weights."""
    weights = np.array([kind.weight for kind in kinds])
    return int(rng.choice(len(kinds), p=weights / weights.sum()))


def _edges(
    time: FloatArray, duration: tuple[float, float], rng: np.random.Generator
) -> FloatArray:
    """Random switching times from the first sample time on, durations uniform in a range."""
    count = int((time[-1] - time[0]) / duration[0]) + 1
    return np.asarray(time[0] + np.cumsum(rng.uniform(*duration, count)))
