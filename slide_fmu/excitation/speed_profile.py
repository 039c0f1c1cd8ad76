"""A move from rest to rest has a trapezoid as its speed over time, with sharp or rounded corners.

The first phase speeds up, the last one slows down, and between them the speed is constant. With
sharp corners the acceleration is constant in a phase. With rounded ones it is a trapezoid itself:
this is the S-curve of motion control (Biagiotti and Melchiorri, "Trajectory Planning for Automatic
Machines and Robots", 2008, chapter 3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray


@final
@dataclass(frozen=True, eq=False)
class SpeedProfiles:
    """SpeedProfiles are B moves from rest to rest; each attribute has the shape (B,).

    They are scaled to the distance 0 .. 1 and the time 0 .. 1.

    Attributes:
        speeding: share of the time in which the speed rises, above 0.
        slowing: share in which it falls, above 0; both together are at most 1.
        rounded: share of these phases in which the acceleration changes: with 0 the corners are
            sharp, with 1 the acceleration is a triangle.
    """

    speeding: FloatArray
    slowing: FloatArray
    rounded: FloatArray

    @staticmethod
    def sharp(ramp: FloatArray) -> SpeedProfiles:
        """Return symmetric profiles with sharp corners; ramps, (B,), are at most 0.5."""
        return SpeedProfiles(ramp, ramp, np.zeros_like(ramp))

    def __getitem__(self, index: int) -> SpeedProfiles:
        """Return one of the profiles, B = 1."""
        one = slice(index, index + 1)
        return SpeedProfiles(self.speeding[one], self.slowing[one], self.rounded[one])

    def way(self, phase: FloatArray) -> FloatArray:
        """Return the covered fraction of the distance, 0 .. 1.

        The phase is the elapsed fraction of the time, (B,) or (B, N). Moves rest before 0 and
        after 1.
        """
        past = np.minimum(np.maximum(phase, 0.0), 1.0)
        columns = [
            part.reshape(-1, *(1,) * (past.ndim - 1))
            for part in (self.speeding, self.slowing, self.rounded)
        ]
        speeding, slowing, rounded = columns
        flat = _flat(speeding, slowing)
        # the second half mirrors the first, so one formula is enough
        first = past < np.minimum(np.maximum(0.5, speeding), 1 - slowing)
        near, ramp = np.where(first, past, 1 - past), np.where(first, speeding, slowing)
        ramped = _ramped(np.minimum(near, ramp), ramp, rounded, flat)
        half = np.where(near < ramp, ramped, (near - ramp / 2) / flat)
        return np.where(first, half, 1 - half)

    def inverse_peaks(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return 1 over the largest absolute first to third derivatives of the way, (B,) each.

        It is 0 for the third derivative of profiles with sharp corners.
        """
        flat, full = _flat(self.speeding, self.slowing), 1 - 0.5 * self.rounded
        phases = [ramp * flat * full for ramp in (self.speeding, self.slowing)]
        corners = [
            0.5 * self.rounded * ramp * phase
            for ramp, phase in zip((self.speeding, self.slowing), phases, strict=True)
        ]
        return flat, np.minimum(*phases), np.minimum(*corners)

    def least_times(self, way: FloatArray, limits: Sequence[FloatArray]) -> FloatArray:
        """Return the shortest times in s in which the profiles keep limits, (B,).

        Args:
            way: distances of all coordinates, (n,), in their units, with or without signs.
            limits: limits of speed, acceleration and jerk, of the first ones or all, (n,) each, in
                the coordinates' units per s, s^2 and s^3; infinite where there is no limit.
        """
        times, distances = np.zeros_like(self.speeding), np.abs(way)
        peaks_and_limits = zip(self.inverse_peaks(), limits, strict=False)
        for order, (inverse, limit) in enumerate(peaks_and_limits, start=1):
            bounded = np.isfinite(limit) & (distances > 0)
            with np.errstate(divide="ignore"):  # sharp corners never keep a limit of the jerk
                needed = distances[bounded] / inverse[:, None] / limit[bounded]
            times = np.maximum(times, (needed ** (1 / order)).max(axis=1, initial=0.0))
        return np.asarray(times)


def fastest_phases(
    way: float, speed: float, fastest: float, acceleration: float
) -> list[tuple[float, float]]:
    """Return the phases of the fastest move with sharp corners, by ``way`` from a speed to rest.

    The move speeds up or slows down to its highest speed, keeps it, and slows down to rest. From
    too high a speed it goes beyond its target, and comes back.

    Args:
        way: distance to the target with its sign.
        speed: speed at the start with its sign.
        fastest: limit of the speed, above 0.
        acceleration: limit of the acceleration, above 0.

    Returns:
        Duration in s and acceleration of each phase.
    """
    sign = 1.0 if way >= 0.5 * speed * abs(speed) / acceleration else -1.0
    peak = math.sqrt(max(sign * way * acceleration + 0.5 * speed**2, 0.0))
    peak = sign * min(peak, fastest)
    first = abs(peak - speed) / acceleration
    last = abs(peak) / acceleration
    cruised = way - 0.5 * (peak + speed) * first - 0.5 * peak * last
    lasts = max(cruised / peak, 0.0) if peak != 0.0 else 0.0
    faster = math.copysign(acceleration, peak - speed)
    return [(first, faster), (lasts, 0.0), (last, -sign * acceleration)]


def _flat(speeding: FloatArray, slowing: FloatArray) -> FloatArray:
    """Return 1 over the constant speed between both phases."""
    return np.asarray(1 - 0.5 * (speeding + slowing))


def _ramped(
    time: FloatArray, ramp: FloatArray, rounded: FloatArray, flat: FloatArray
) -> FloatArray:
    """Return the way in a phase that begins at rest, at times from its begin to its end."""
    corner = 0.5 * rounded * ramp
    shortest = np.maximum(corner, np.finfo(np.float64).tiny)
    # in the middle, where the acceleration is constant, both are zero
    cubes = np.maximum(corner - time, 0.0) ** 3 + np.maximum(time - ramp + corner, 0.0) ** 3
    squares = time**2 - corner * time + (corner**2 - cubes / shortest) / 3
    return np.asarray(squares / (2 * ramp * flat * (1 - 0.5 * rounded)))
