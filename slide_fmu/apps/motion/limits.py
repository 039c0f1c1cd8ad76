"""A motion keeps limits of speed, acceleration and jerk, formed as differences."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray

TOLERANCE = 1e-6
"""A limit is kept up to this fraction of it: linear programs are about this accurate."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of every coordinate, each of shape (n_coordinates,); infinite if not known.

    Differences of samples replace derivatives. With a first-order hold, the difference of
    neighbours is the speed itself.

    Attributes:
        low, high: of the coordinate.
        speed, acceleration, jerk: largest absolute values, in its unit per s, s^2 and s^3.
    """

    low: FloatArray
    high: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def derivatives(self) -> Iterator[tuple[str, int, FloatArray]]:
        """Give name, order and limit of every derivative."""
        yield "speed", 1, self.speed
        yield "acceleration", 2, self.acceleration
        yield "jerk", 3, self.jerk

    def used(self, start: FloatArray, motion: FloatArray, step: float) -> dict[str, float]:
        """Return the used fraction of each given limit by a motion, at its worst.

        Args:
            start: where it rests before its first sample, (n_coordinates,).
            motion: it rests after its last sample, (N, n_coordinates).
            step: time between samples, in s.
        """
        used = {}
        padded = np.concatenate([np.tile(start, (3, 1)), motion, np.tile(motion[-1], (3, 1))])
        for name, order, limit in self.derivatives():
            if np.isinf(limit).all():
                continue
            largest = np.abs(np.diff(padded, n=order, axis=0)).max(axis=0) / step**order
            used[name] = float(np.max(largest / limit))
        ranged = np.isfinite(self.high - self.low)  # angles have no range
        if ranged.any():
            low, high = self.low[ranged], self.high[ranged]
            away = np.abs(motion[:, ranged] - 0.5 * (low + high)).max(axis=0)
            used["range"] = float(np.max(away / (0.5 * (high - low))))
        return used

    def kept(self, start: FloatArray, motion: FloatArray, step: float) -> bool:
        """Return whether a motion, as for ``used``, keeps all limits."""
        return max(self.used(start, motion, step).values(), default=0.0) <= 1 + TOLERANCE
