"""The distance from one point to another is one function of time, shared by all coordinates.

Its acceleration is a trapezoid, then rest, then a trapezoid of the other sign: the S-curve of
motion control. Everything here is scaled to the distance 0 .. 1 and the time 0 .. 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.core.signals import FloatArray

LEAST_JERK_SHARE = 0.02
"""Smallest share of a ramp of acceleration in its phase, so that one formula is enough."""


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles are B rest-to-rest motions; each attribute has the shape (B,).

    Attributes:
        speeding: share of the time in which the speed rises, above 0.
        slowing: share in which it falls; both together are at most 1.
        rounded: share of these phases in which the acceleration changes; with 1 it is a triangle.
            Values below ``LEAST_JERK_SHARE`` count as that share.
    """

    speeding: FloatArray
    slowing: FloatArray
    rounded: FloatArray

    def way(self, done: FloatArray) -> FloatArray:
        """Return the distance, 0 .. 1, after fractions of the time, (B, N): before 0, later 1."""
        times, jerks = self._jerk_steps()
        past = np.maximum(np.minimum(done, 1.0)[:, :, None] - times[:, None, :], 0.0)
        return np.asarray(np.einsum("bk,bnk->bn", jerks / 6.0, past**3))

    def peaks(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the largest absolute first to third derivatives of the distance, (B,) each."""
        up, down, speed = self._accelerations()
        rounded = np.maximum(self.rounded, LEAST_JERK_SHARE)
        jerk = 2 / rounded * np.maximum(up / self.speeding, down / self.slowing)
        return speed, np.maximum(up, down), jerk

    def _accelerations(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the heights of both trapezoids, and the speed between them."""
        full = 1 - 0.5 * np.maximum(self.rounded, LEAST_JERK_SHARE)
        speed = 1 / (1 - 0.5 * (self.speeding + self.slowing))
        return speed / (self.speeding * full), speed / (self.slowing * full), speed

    def _jerk_steps(self) -> tuple[FloatArray, FloatArray]:
        """Return the times and sizes of the jumps of the jerk, (B, 8) each."""
        up, down, _ = self._accelerations()
        ramp = 0.5 * np.maximum(self.rounded, LEAST_JERK_SHARE)
        times, jerks = [], []
        for begin, length, height in (
            (np.zeros_like(ramp), self.speeding, up),
            (1 - self.slowing, self.slowing, -down),
        ):
            jerk = height / (ramp * length)
            times += [begin + share * length for share in (0.0, ramp, 1 - ramp, 1.0)]
            jerks += [jerk, -jerk, -jerk, jerk]
        return np.stack(times, axis=1), np.stack(jerks, axis=1)


def least_times(profiles: Profiles, way: FloatArray, limits: Limits) -> FloatArray:
    """Return the shortest times in s of profiles over a distance, (n_coordinates,)."""
    found = [np.zeros_like(profiles.speeding)]
    for peak, (_, order, limit) in zip(profiles.peaks(), limits.derivatives(), strict=True):
        needed = float(np.max(np.abs(way) / limit))
        found.append((peak * needed) ** (1 / order))
    return np.asarray(np.max(found, axis=0))


def least_steps(way: FloatArray, limits: Limits, step: float) -> int:
    """Return the least number of steps in which samples cover a distance, (n_coordinates,).

    Jerk and vibration count for nothing, so no move at all takes fewer.
    """
    count = 1
    while True:
        rising = np.minimum(np.arange(1, count + 1), np.arange(count, 0, -1))[:, None]
        speeds = np.minimum(limits.speed, rising * step * limits.acceleration)
        if (step * speeds.sum(axis=0) >= np.abs(way) * (1 - 1e-9)).all():
            return count
        count += 1


def fastest(way: FloatArray, limits: Limits) -> tuple[Profiles, float]:
    """Return the fastest symmetric profile over a distance within limits, and its time in s.

    Without a limit of the jerk it is the fastest trapezoid of the speed, to about 2 %: it is the
    best of a grid, and its corners are rounded by ``LEAST_JERK_SHARE``.
    """
    ramp, rounded = np.meshgrid(np.geomspace(0.01, 0.5, 400), np.linspace(LEAST_JERK_SHARE, 1, 50))
    grid = Profiles(ramp.ravel(), ramp.ravel(), rounded.ravel())
    times = least_times(grid, way, limits)
    best = int(np.argmin(times))
    one = Profiles(*(getattr(grid, name)[best : best + 1] for name in Profiles.__annotations__))
    return one, float(times[best])
