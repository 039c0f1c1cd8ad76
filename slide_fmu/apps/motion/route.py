"""The route of a move in space is straight, or a smooth curve past points between its ends.

Coordinates are functions of one number that goes from 0 at the start to 1 at the goal. Or each
moving coordinate of a straight route has such a number of its own: then only the ends are on it.

The fastest profile along a route keeps all limits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import lsq_linear

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.predictor import MotionError
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


ROUNDED = 0.8
"""Fraction of the tolerance by which curves round their points: chords between samples cut too."""

FINE = 400
"""Number of samples of a curve to find its bends and its fastest profile."""

BETWEEN = 8
"""Number of points of each step that are checked for passing, if inputs move between samples."""


@dataclass(frozen=True, eq=False)
class Route:
    """A Route leads from the first of some points to the last one, past the points in between.

    Past these it is a cubic spline, with the least bending that their tolerance allows.

    Attributes:
        points: coordinates, (n, n_coordinates), at least two.
        near: largest distance of each coordinate from the points between, (n_coordinates,);
            infinite if there are none.
        pace: distances that coordinates cover in the same time, (n_coordinates,): a curve takes
            shares between points in proportion to their time.

    Raises:
        MotionError: two successive points are the same.
    """

    points: FloatArray
    near: FloatArray
    pace: FloatArray

    def __post_init__(self) -> None:
        for index, (one, other) in enumerate(zip(self.points, self.points[1:], strict=False)):
            if np.array_equal(one, other):
                names = ["start", *(f"via {k}" for k in range(1, len(self.points) - 1)), "goal"]
                raise MotionError(
                    f"{names[index]} and {names[index + 1]} are both {one.tolist()}; expected two "
                    "points: correct the task"
                )

    @property
    def start(self) -> FloatArray:
        """Coordinates at its start, (n_coordinates,)."""
        return np.asarray(self.points[0])

    @property
    def goal(self) -> FloatArray:
        """Coordinates at its end, (n_coordinates,)."""
        return np.asarray(self.points[-1])

    @property
    def straight(self) -> bool:
        """Whether the route passes no points."""
        return len(self.points) == 2

    def at(self, share: FloatArray) -> FloatArray:
        """Return coordinates, (..., n_coordinates), at shares of the route, (...)."""
        if self.straight:
            return np.asarray(self.start + share[..., None] * (self.goal - self.start))
        return np.asarray(self._curve(share))

    @property
    def moving(self) -> NDArray[np.intp]:
        """The coordinates that differ between the ends."""
        return np.flatnonzero(self.goal != self.start)

    def along(self, shares: FloatArray) -> FloatArray:
        """Return coordinates as ``at``, for shares (..., 1), or own ones, (..., n_moving)."""
        if shares.shape[-1] == 1:
            return self.at(shares[..., 0])
        motion = np.broadcast_to(self.start, (*shares.shape[:-1], len(self.start))).copy()
        motion[..., self.moving] += shares * (self.goal - self.start)[self.moving]
        return motion

    def slopes(self, share: FloatArray) -> FloatArray:
        """Return the derivatives of the coordinates by the share, as for ``at``."""
        if self.straight:
            shape = (*share.shape, len(self.start))
            return np.broadcast_to(self.goal - self.start, shape)
        return np.asarray(self._curve(share, 1))

    def binding(self, limit: FloatArray) -> list[int]:
        """Return the coordinates that may reach a limit, (n_coordinates,), before all others."""
        if not self.straight:
            return [int(one) for one in np.flatnonzero(np.isfinite(limit))]
        used = np.abs(self.goal - self.start) / limit
        return [int(np.argmax(used))] if used.max() > 0 else []

    def missed(self, motion: FloatArray, moving: bool) -> float:
        """Return the largest miss of a point by a motion, relative to the tolerance.

        Args:
            motion: coordinates after the start, (count, n_coordinates).
            moving: whether they move from sample to sample, instead of jumping.
        """
        if self.straight:
            return 0.0
        parts = np.arange(BETWEEN) / BETWEEN if moving else np.zeros(1)
        passed = np.vstack([self.start, motion])  # a point may already be near enough to the start
        rows = passed[:-1, None] + parts[:, None] * np.diff(passed, axis=0)[:, None]
        away = np.abs(rows.reshape(-1, 1, rows.shape[-1]) - self.points[1:-1]) / self.near
        return float(away.max(axis=2).min(axis=0).max())

    @cached_property
    def _curve(self) -> CubicSpline:
        steps = np.abs(np.diff(self.points, axis=0)) / self.pace
        knots = np.concatenate([[0.0], np.cumsum(steps.max(axis=1))])
        knots /= knots[-1]
        unit = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")
        bends = unit(np.linspace(0, 1, FINE), 2)
        passed = self.points.copy()
        for index, near in enumerate(ROUNDED * self.near):
            ends, middle = self.points[[0, -1], index], self.points[1:-1, index]
            bounds = (middle - near, middle + near)
            least = lsq_linear(bends[:, 1:-1], -bends[:, [0, -1]] @ ends, bounds)
            passed[1:-1, index] = np.clip(least.x, *bounds)
        return CubicSpline(knots, passed, bc_type="natural")


def fastest_along(route: Route, limits: Limits) -> tuple[SpeedProfiles, float]:
    """Return the fastest symmetric profile along a route within limits, and its time in s.

    Along a curve it is approximately the fastest: the best of a coarse grid, by differences.
    """
    if route.straight:
        return fastest(route.goal - route.start, limits)
    ramp, rounded = np.meshgrid(np.geomspace(0.05, 0.5, 16), np.linspace(LEAST_ROUNDED, 1, 8))
    grid = SpeedProfiles(ramp.ravel(), ramp.ravel(), rounded.ravel())
    motions = route.at(grid.way(np.tile(np.linspace(0, 1, FINE), (ramp.size, 1))))
    times = np.zeros(ramp.size)
    for _, order, limit in limits.derivatives():
        peaks = np.abs(np.diff(motions, n=order, axis=1)).max(axis=1) * (FINE - 1) ** order
        times = np.maximum(times, (peaks / limit).max(axis=1) ** (1 / order))
    best = int(np.argmin(times))
    return grid[best], float(times[best])
