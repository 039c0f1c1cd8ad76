"""This module finds faults in a column: saturation, coarse rounding and single outliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray

RUN = 3
"""A run has at least this number of equal samples at an extreme, one after the other."""

LEVELS = 20
"""A column with fewer different values counts as switched between levels, not as saturated."""

STEEP = 10.0
"""A run is entered steeply if two samples before it are this number of resolutions away from it.

A smooth peak that is rounded to the resolution stays below 5 for runs of at least three samples.
"""

FEWEST = 2
"""A saturation has at least this number of runs at an extreme, entered steeply."""

REGULAR = 1e-3
"""Values are multiples of a resolution if they are off by this part of it at most."""

FAR = 10.0
"""Both differences of an outlier to its neighbours are at least this multiple of the usual one."""

NORMAL = 1.4826
"""The median of absolute values times this is the standard deviation, where they are normal."""

AROUND = 10
"""This number of differences before and behind a sample gives the usual difference there."""


@dataclass(frozen=True)
class Saturation:
    """A Saturation is an extreme value at which a column stops.

    Attributes:
        value: the extreme, in the column's unit.
        samples: number of samples in runs at it.
        runs: number of runs.
        first: index of the first sample of the first of them.
    """

    value: float
    samples: int
    runs: int
    first: int


def saturations(values: FloatArray) -> list[Saturation]:
    """Find the extremes at which finite values, shape (N,), stop repeatedly.

    A limit cuts a motion off: it is entered or left steeply, stays exactly equal, and the value
    was moving towards it. A held or switched signal jumps from rest, a rounded peak is flat.
    """
    levels = np.unique(values)
    if len(levels) < LEVELS:
        return []
    resolution = float(np.diff(levels).min())
    limits = []
    for extreme in (float(levels[0]), float(levels[-1])):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], values == extreme, [False]])))
        distance = np.abs(values - extreme)
        cut = [
            (begin, end)
            for begin, end in edges.reshape(-1, 2).tolist()
            if end - begin >= RUN
            and (
                _steep(distance[:begin][::-1][:3], resolution)
                or _steep(distance[end : end + 3], resolution)
            )
        ]
        if len(cut) >= FEWEST:
            samples = sum(end - begin for begin, end in cut)
            limits.append(Saturation(extreme, samples, len(cut), cut[0][0]))
    return limits


def _steep(outside: FloatArray, resolution: float) -> bool:
    """Tell whether the samples on both sides of a run move away from it steeply and steadily."""
    if len(outside) < 3:
        return False
    return bool((np.diff(outside) > 0).all()) and float(outside[1]) > STEEP * resolution


@dataclass(frozen=True)
class Quantization:
    """A Quantization is a resolution of which values are multiples.

    Attributes:
        resolution: the resolution, in the column's unit.
        levels: number of different values.
        noise: root mean square of the rounding, resolution / sqrt(12), as part of the column's
            standard deviation.
    """

    resolution: float
    levels: int
    noise: float


def quantization(values: FloatArray) -> Quantization | None:
    """Find the resolution of finite values, shape (N,), if they are rounded to one.

    None where the values are not multiples of one number, or have few levels.
    """
    levels = np.unique(values)
    if len(levels) < LEVELS or 2 * len(levels) > len(values):
        return None
    resolution = float(np.diff(levels).min())
    multiples = (levels - levels[0]) / resolution
    if multiples[-1] > 1 / np.finfo(np.float64).eps ** 0.5:
        return None  # such a small resolution is the rounding of the numbers themselves
    resolution = float(levels[-1] - levels[0]) / round(float(multiples[-1]))
    multiples = (levels - levels[0]) / resolution
    if np.abs(multiples - np.round(multiples)).max() > REGULAR:
        return None
    noise = resolution / float(np.sqrt(12.0)) / float(values.std())
    return Quantization(resolution, len(levels), noise)


def outliers(values: FloatArray) -> NDArray[np.intp]:
    """Find the indices of single samples that jump away and back, in finite values, shape (N,).

    The usual difference is the median of the absolute differences between neighbours, over the
    whole column and on either side of the sample, so a burst after a rest has no outliers. A step
    jumps, but not back.
    """
    differences = np.diff(values)
    moving = np.abs(differences[differences != 0])
    if not len(moving):
        return np.empty(0, np.intp)
    limit = FAR * NORMAL * float(np.median(moving))
    to, back = differences[:-1], differences[1:]
    least = np.where(to * back < 0, np.minimum(np.abs(to), np.abs(back)), 0.0)
    candidates = [int(k) for k in 1 + np.flatnonzero(least > limit)]
    sizes = np.abs(differences)
    return np.array([k for k in candidates if _is_far(sizes, k, least[k - 1])], np.intp)


def _is_far(sizes: FloatArray, sample: int, least: float) -> bool:
    """Tell whether a jump is far compared with the differences on either side of it."""
    before = sizes[max(0, sample - 1 - AROUND) : sample - 1]
    behind = sizes[sample + 1 : sample + 1 + AROUND]
    usual = [float(np.median(side)) for side in (before, behind) if len(side)]
    return bool(usual) and least > FAR * NORMAL * max(usual)
