"""Columns that stop at a limit, and columns that have few values: saturation and quantization."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray

RUN = 3
"""So many equal samples at an extreme, one after the other, are a run."""

LEVELS = 20
"""A column of fewer different values switches between levels, and is not limited by the sensor."""

STEEP = 10.0
"""A run is entered steeply if two samples before it are so many resolutions away from it.

A smooth peak that is rounded to the resolution stays below 5 for runs of at least three samples.
"""

FEWEST = 2
"""So many runs at an extreme, entered steeply, make a saturation."""

REGULAR = 1e-3
"""Values are multiples of a resolution if they are off by so much of it at most."""


@dataclass(frozen=True)
class Saturation:
    """A Saturation is an extreme value at which a column stops.

    Attributes:
        value: the extreme, in the column's unit.
        samples: how many samples lie in runs at it.
        runs: how many runs there are.
        first: index of the first sample of the first of them.
    """

    value: float
    samples: int
    runs: int
    first: int


def saturations(values: FloatArray) -> list[Saturation]:
    """Find the extremes at which finite values, shape (N,), stop again and again.

    A limit cuts a motion off: it is entered or left steeply, stays exactly equal, and the value
    was moving towards it. A held or switched signal jumps from rest, a rounded peak is flat.
    """
    levels = np.unique(values)
    if len(levels) < LEVELS:
        return []
    resolution = float(np.diff(levels).min())
    found = []
    for extreme in (float(levels[0]), float(levels[-1])):
        begins, ends = _runs(values == extreme)
        distance = np.abs(values - extreme)
        cut = [
            (begin, end)
            for begin, end in zip(begins, ends, strict=True)
            if _steep(distance[:begin][::-1][:3], resolution)
            or _steep(distance[end : end + 3], resolution)
        ]
        if len(cut) >= FEWEST:
            samples = sum(end - begin for begin, end in cut)
            found.append(Saturation(extreme, samples, len(cut), cut[0][0]))
    return found


def _runs(at: np.ndarray) -> tuple[list[int], list[int]]:
    """Give begins and ends (excluded) of the long enough runs in which a condition holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]])))
    begins, ends = edges[::2], edges[1::2]
    long = ends - begins >= RUN
    return begins[long].tolist(), ends[long].tolist()


def _steep(outside: FloatArray, resolution: float) -> bool:
    """Tell whether the samples beside a run, from it outwards, lead steeply and steadily away."""
    if len(outside) < 3:
        return False
    away = np.diff(outside)
    return bool((away > 0).all()) and float(outside[1]) > STEEP * resolution


@dataclass(frozen=True)
class Quantization:
    """A Quantization says that values are multiples of a resolution.

    Attributes:
        resolution: in the column's unit.
        levels: how many different values there are.
        noise: root mean square of the rounding, resolution / sqrt(12), as part of the column's
            standard deviation.
    """

    resolution: float
    levels: int
    noise: float


def quantization(values: FloatArray) -> Quantization | None:
    """Find the resolution of finite values, shape (N,), if they are rounded to one.

    None where the values are no multiples of one number, or are few levels that are switched.
    """
    levels = np.unique(values)
    if len(levels) < LEVELS or 2 * len(levels) > len(values):
        return None
    resolution = float(np.diff(levels).min())
    multiples = (levels - levels[0]) / resolution
    if multiples[-1] > 1 / np.finfo(np.float64).eps ** 0.5:
        return None  # as fine as this, the numbers themselves are rounded
    resolution = float(levels[-1] - levels[0]) / round(float(multiples[-1]))
    multiples = (levels - levels[0]) / resolution
    if np.abs(multiples - np.round(multiples)).max() > REGULAR:
        return None
    noise = resolution / float(np.sqrt(12.0)) / float(values.std())
    return Quantization(resolution, len(levels), noise)
