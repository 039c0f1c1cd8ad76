"""Inputs are held at points of the box of their ranges, and move from point to point.

Kinds that draw every input independently hardly ever bring all inputs to the ends of their ranges
at once and hold them there. Users do: a pump at its maximum with a valve at its minimum is a
steady state.
"""

from __future__ import annotations

from itertools import product
from typing import Any, Literal

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, within_ranges
from slide_fmu.excitation.base import Kind, PositiveRange
from slide_fmu.excitation.descriptions import between

MOST_INPUTS = 4
"""Up to this number of inputs all corners are used; above it a subset that fills the box."""

SOME_CORNERS = 16
"""Number of corners used for more inputs."""

CORNERS = 0.5
"""Fraction of the points that are corners."""


class Box(Kind):
    """All inputs are held at corners and inner points of the box of their ranges, alternately.

    The factor multiplies the distance of all points from the middle of the ranges.

    Attributes:
        duration: range in s of the time for which a point is held.
        ramp: range in s of the time of a move from point to point. It is drawn uniformly on a
            logarithmic scale, so that slow and fast moves occur. Below a sample step, inputs jump.
    """

    kind: Literal["box"]
    duration: PositiveRange
    ramp: PositiveRange

    def check(self, signals: tuple[Signal, ...]) -> None:
        angles = [signal.name for signal in signals if signal.angle is not None]
        if angles:
            raise ValueError(
                f"kind = 'box' with inputs {angles}, which are cosine and sine of an angle; "
                "expected none: corners of their ranges are no angles. Use speed_ramps"
            )

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        names = "the input is" if len(signals) == 1 else "all inputs are"
        return (
            f"{names} held at the ends of the range and inside of it by turns, each for "
            f"{between(self.duration, 's')}; a move takes {between(self.ramp, 's')}"
        )

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Draw all inputs together; see the class."""
        n = len(signals)
        length = time[-1] - time[0] + 2 * (self.duration[1] + self.ramp[1])
        count = int(length / (self.duration[0] + self.ramp[0])) + 2
        inner = 2 * _sobol(n, rng).random(1 << (count - 1).bit_length())[:count] - 1
        every = corners_of_box(n)
        order = np.concatenate(
            [rng.permutation(len(every)) for _ in range(count // len(every) + 1)]
        )
        points = np.where(rng.random(count)[:, None] < CORNERS, every[order[:count]], inner)
        holds = rng.uniform(*self.duration, count)
        fast, slow = np.log(self.ramp)
        ramps = np.exp(rng.uniform(fast, slow, count))
        arrivals = np.cumsum(ramps + holds) - holds - rng.uniform(0, ramps[0] + holds[0])
        knots = np.stack([arrivals, arrivals + holds], axis=1).ravel() + time[0]
        columns = []
        for signal, values in zip(signals, points.T, strict=True):
            middle, half = 0.5 * (signal.high + signal.low), 0.5 * (signal.high - signal.low)
            normalised = np.interp(time, knots, np.repeat(values, 2))
            columns.append(middle + half * factor * normalised)
        inputs = np.stack(columns, axis=1)
        return within_ranges(signals, inputs) if factor <= 1 else inputs  # rounding


def corners_of_box(n_inputs: int) -> FloatArray:
    """Return corners of the box from -1 to 1, (n_corners, n_inputs), in a fixed order.

    Up to ``MOST_INPUTS`` inputs, all corners are returned. Above, they are the corners nearest to
    Sobol points, so that every input is low as often as high.
    """
    if n_inputs <= MOST_INPUTS:
        return np.array(list(product((-1.0, 1.0), repeat=n_inputs)))
    inner = _sobol(n_inputs, np.random.default_rng(0)).random(SOME_CORNERS)
    return np.where(inner < 0.5, -1.0, 1.0)


def points_inside(n_inputs: int, count: int) -> FloatArray:
    """Return Sobol points of the box from -1 to 1, (count, n_inputs), in a fixed order.

    The count is a power of two.
    """
    sobol = _sobol(n_inputs, np.random.default_rng(1))
    return np.asarray(2 * sobol.random(count) - 1)


def at_points(signals: tuple[Signal, ...], points: FloatArray) -> FloatArray:
    """Return points of the box from -1 to 1 in the units of the inputs, (n, n_inputs)."""
    low, high = (np.array([getattr(s, end) for s in signals]) for end in ("low", "high"))
    # ends are copied: rounding must not move a point out of its range
    return within_ranges(signals, (high + low) / 2 + (high - low) / 2 * points)


def _sobol(n_inputs: int, rng: np.random.Generator) -> Any:
    """Return a Sobol sequence; scipy is imported here, since reading a recipe does not need it."""
    from scipy.stats import qmc

    return qmc.Sobol(n_inputs, seed=rng)
