"""A rotation speeds up and slows down in ramps; the inputs are its cosine and sine.

This is the excitation of the paper's crank (section "Planar flexible slider-crank"). The defaults
for the phases are the paper's.
"""

from __future__ import annotations

import itertools
import math
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.units import behind
from slide_fmu.excitation.base import CountRange, Kind, PositiveFloat, Share
from slide_fmu.excitation.descriptions import between

CONSTANT_SPEED = 0.1
"""Share of the phases in which the speed stays constant, as in the paper."""


class SpeedRamps(Kind):
    """One angle moves in phases of constant acceleration; the inputs are its cosine and sine.

    The speed is continuous and stays at its limit if a phase would exceed it. The motion starts at
    a random angle and speed, inside a phase. The amplitude factor multiplies the limits of speed
    and acceleration.

    Attributes:
        speed: limit of the angular speed in rad/s.
        acceleration: limit of the angular acceleration in rad/s^2; each phase draws its own
            uniformly between minus and plus this limit.
        samples: range of the length of a phase in samples, both ends included.
        rest: share of the phases in which the rotation slows down at the limit of the
            acceleration, and then rests.
        noise: half the width of the uniform noise on the speed, relative to its limit. It is added
            to about every second step, at random; it may exceed the limits.
    """

    drives_axes: ClassVar[bool] = True

    kind: Literal["speed_ramps"]
    speed: PositiveFloat
    acceleration: PositiveFloat
    samples: CountRange = (20, 60)
    rest: Share = 0.0
    noise: float = Field(default=0.0, ge=0)

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse inputs that are not two, or that cannot take all values of cosine and sine.

        Inputs declared as cosine and sine of an angle can: the end of their range is their length.

        Raises:
            ValueError: the number of inputs is not 2, or a range does not contain -1 .. 1.
        """
        names = [signal.name for signal in signals]
        if len(signals) != 2:
            raise ValueError(
                f"kind = 'speed_ramps' for {len(signals)} inputs {names}; expected two, the "
                "cosine and the sine of one angle: use another kind of excitation"
            )
        for signal in signals:
            if signal.angle is None and (signal.low > -1 or signal.high < 1):
                raise ValueError(
                    f"kind = 'speed_ramps' for {signal.name!r} of range {signal.low:g} .. "
                    f"{signal.high:g}{behind(signal.unit)}; expected -1 .. 1, a cosine or sine: "
                    "use "
                    "another kind of excitation, or correct the range"
                )

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        phases = between((step * self.samples[0], step * self.samples[1]), "s")
        text = (
            f"the angle of {' and '.join(signal.name for signal in signals)} turns at up to "
            f"{self.speed:g} rad/s, to and fro, in phases of {phases} with constant accelerations "
            f"of up to {self.acceleration:g} rad/s^2 (no box: shorter phases were not drawn)"
        )
        if self.rest:
            text += f", and comes to rest in {100 * self.rest:g} % of them"
        if self.noise == 0:
            return text
        return f"{text}; speeds are noisy by {100 * self.noise:g} % of the limit"

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw the cosine and the sine of the angle at the sample times, shape (N, 2)."""
        angle = self.angle(time, factor, rng)
        length = 1.0 if signals[0].angle is None else signals[0].high
        return length * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def angle(self, time: FloatArray, factor: float, rng: np.random.Generator) -> FloatArray:
        """Draw the angle in rad at the sample times, shape (N,); it is not wrapped to one turn."""
        count = len(time) - 1
        start = rng.uniform(-np.pi, np.pi)
        if count == 0:
            return np.array([start])
        step, limit = (time[-1] - time[0]) / count, factor * self.speed
        wanted = factor * self._accelerations(count, rng)
        braking = factor * self.acceleration
        speed = _speeds(rng.uniform(-limit, limit), step * wanted, limit, step * braking)
        acceleration = np.where(np.isnan(wanted), -braking * np.sign(speed[:-1]), wanted)
        moved = _integral(speed, acceleration, step)
        if self.noise > 0:
            noise = rng.uniform(-self.noise * limit, self.noise * limit, count)
            moved += step * np.where(rng.random(count) < 0.5, noise, 0.0)
        return start + np.concatenate([[0.0], np.cumsum(moved)])

    def _accelerations(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Draw the acceleration over every step in rad/s^2, shape (count,), at factor 1.

        It is NaN where the rotation comes to rest.
        """
        lengths = rng.integers(self.samples[0], self.samples[1] + 1, count + 1)
        values = rng.uniform(-self.acceleration, self.acceleration, count + 1)
        values[rng.random(count + 1) < CONSTANT_SPEED] = 0.0
        if self.rest > 0:
            values[rng.random(count + 1) < self.rest] = np.nan
        begun = rng.integers(lengths[0])  # the trajectory starts somewhere inside the first phase
        return np.repeat(values, lengths)[begun : begun + count]


def _speeds(start: float, changes: FloatArray, limit: float, braking: float) -> FloatArray:
    """Return speeds in rad/s that change step by step within +-limit, shape (N + 1,).

    Where a change, (N,), is NaN, the speed approaches zero by ``braking`` in rad/s.
    """

    def changed(speed: float, change: float) -> float:
        if math.isnan(change):
            return speed - min(max(speed, -braking), braking)
        return min(max(speed + change, -limit), limit)

    return np.array(list(itertools.accumulate(changes, changed, initial=start)))


def _integral(speed: FloatArray, acceleration: FloatArray, step: float) -> FloatArray:
    """Integrate the speed in rad/s, (N + 1,), over steps in s exactly, to angles in rad, (N,).

    The acceleration in rad/s^2, (N,), is before limiting; at the limit the speed stays constant.
    """
    # at the limit, a step changes its speed for ``changing`` s only
    change = np.diff(speed)
    changing = np.divide(change, acceleration, out=np.zeros_like(change), where=change != 0)
    return np.asarray(speed[1:] * step - 0.5 * change * changing)
