"""The fastest profiles of moves within limits; profiles are those of ``speed_profile``."""

from __future__ import annotations

import numpy as np

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.speed_profile import SpeedProfiles

LEAST_ROUNDED = 0.02
"""Smallest share of a phase in which the acceleration of a move changes: real axes cannot jump."""


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


def fastest(way: FloatArray, limits: Limits) -> tuple[SpeedProfiles, float]:
    """Return the fastest symmetric profile over a distance within limits, and its time in s.

    Without a limit of the jerk it is the fastest trapezoid of the speed, to about 2 %: it is the
    best of a grid, and its corners are rounded by ``LEAST_ROUNDED``.
    """
    ramp, rounded = np.meshgrid(np.geomspace(0.01, 0.5, 400), np.linspace(LEAST_ROUNDED, 1, 50))
    grid = SpeedProfiles(ramp.ravel(), ramp.ravel(), rounded.ravel())
    times = grid.least_times(way, [limit for _, _, limit in limits.derivatives()])
    best = int(np.argmin(times))
    return grid[best], float(times[best])
