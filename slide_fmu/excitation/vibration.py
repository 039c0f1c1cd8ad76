"""Set points vibrate while they move slowly, as with a shaken or badly tuned machine."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.base import Kind, Limits, PositiveRange, Share, require_one_each
from slide_fmu.excitation.descriptions import between, listed

DURATION = (2.0, 8.0)
"""Range of the time from point to point in s, drawn uniformly."""
REACH = 0.8
"""Share of the range, about its middle, from which the points are drawn."""


class Vibration(Kind):
    """Every input moves from point to point, with a sine that swells and fades during each move.

    The move to the next point has minimum jerk (Flash and Hogan, 1985). A burst lasts as long as
    the move; its sines share one frequency, and each input has its own phase and amplitude. The
    amplitude factor multiplies the amplitudes of the sines, but not the points.

    Attributes:
        angular_frequency: range in rad/s; its logarithm is drawn uniformly.
        acceleration: largest acceleration of each input's sine, in its unit per s^2; every burst
            draws its own value between zero and this.
        single: share of the bursts in which one random input vibrates alone.
    """

    drives_axes: ClassVar[bool] = True

    kind: Literal["vibration"]
    angular_frequency: PositiveRange
    acceleration: Limits = Field(min_length=1)
    single: Share = 0.3

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse accelerations if there is not exactly one for each input.

        Raises:
            ValueError: the number of accelerations is not the number of inputs.
        """
        require_one_each(self.kind, "acceleration", self.acceleration, signals)

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        return (
            f"every input moves from point to point within {100 * REACH:g} % of its range, "
            f"in {between(DURATION, 's')}, and shakes on the way at "
            f"{between(self.angular_frequency)} rad/s with accelerations of up to "
            f"{listed(self.acceleration, signals, 's^2')}; {100 * self.single:g} % of the times "
            "one input shakes alone"
        )

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw the inputs at the sample times, shape (N, n_inputs); they stay in their ranges."""
        low, high = (np.array([getattr(s, end) for s in signals]) for end in ("low", "high"))
        middle, half_range = 0.5 * (low + high), 0.5 * REACH * (high - low)
        elapsed = time - time[0]
        point = rng.uniform(middle - half_range, middle + half_range)
        values, begin = np.empty((len(time), len(signals))), 0.0
        while begin <= elapsed[-1]:
            duration = rng.uniform(*DURATION)
            target = rng.uniform(middle - half_range, middle + half_range)
            frequency = np.exp(rng.uniform(*np.log(self.angular_frequency)))
            phase = rng.uniform(-np.pi, np.pi, len(signals))
            share = rng.uniform(0, 1, len(signals))
            if rng.random() < self.single:
                share *= np.arange(len(signals)) == rng.integers(len(signals))
            amplitude = factor * share * np.array(self.acceleration) / frequency**2
            now = (elapsed >= begin) & (elapsed < begin + duration)
            past = elapsed[now, None] - begin
            done = past / duration
            sine = amplitude * np.sin(frequency * past + phase)
            values[now] = point + least_jerk(done) * (target - point) + swelling(done) * sine
            point, begin = target, begin + duration
        return np.clip(values, low, high)


def least_jerk(done: FloatArray) -> FloatArray:
    """Return the fraction of the distance covered after a fraction of the time, both 0 .. 1."""
    return np.asarray(done**3 * (10 - 15 * done + 6 * done**2))


def swelling(done: FloatArray) -> FloatArray:
    """Return the relative amplitude of a burst after a fraction of its time: 0 at both ends."""
    return np.asarray(np.sin(np.pi * done) ** 2)
