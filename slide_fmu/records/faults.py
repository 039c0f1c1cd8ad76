"""This module finds faults in a column.

They are saturation, coarse rounding, single outliers, codes for missing values, values that a
sensor holds, and values of a rate of their own.
"""

from __future__ import annotations

import re
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


STUCK = 20
"""A sensor stands still if it gives one value for at least so many samples."""

SELDOM = 0.01
"""Elsewhere at most this part of its values equals the one before."""


def stuck(values: FloatArray) -> tuple[int, int] | None:
    """Return begin and end of the longest run of one value in a column that else never rests.

    It is None without such a run of ``STUCK`` finite values in values of shape (N,), and where all
    values are one. Measured values always have some noise, and two of them are hardly ever equal:
    a column that often rests is held, coarse, or follows a machine that stops.
    """
    same = np.concatenate([[False], values[1:] == values[:-1], [False]])
    edges = np.flatnonzero(np.diff(same)).reshape(-1, 2)
    if not len(edges):
        return None
    begin, end = edges[np.argmax(edges[:, 1] - edges[:, 0])].tolist()
    end += 1
    if end - begin == len(values):  # constant, which says something else
        return None
    elsewhere = int(same.sum()) - (end - begin - 1)
    if end - begin < STUCK or elsewhere > SELDOM * (len(values) - (end - begin)):
        return None
    return begin, end


def without_runs(values: FloatArray, least: int) -> FloatArray:
    """Return values, (N,), with NaN in runs of at least so many equal ones."""
    same = np.concatenate([[False], values[1:] == values[:-1], [False]])
    left = values.copy()
    for begin, end in np.flatnonzero(np.diff(same)).reshape(-1, 2).tolist():
        if end + 1 - begin >= least:
            left[begin : end + 1] = np.nan
    return left


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


CODE = re.compile(r"-?(9{3,}(\.9+)?|999\.25|32767|32768|65535|2147483647|2147483648|1e\+?[23]\d)")
"""Numbers that programs write for missing values, as ``:.10g`` writes them: nines, ends of
integers, powers of ten that nothing measures."""

SEVERAL = 3
"""A number that is no usual code may be one if it comes at least this many times, in runs."""


@dataclass(frozen=True)
class Code:
    """A Code is a number, far from all others, that may stand for missing values.

    Attributes:
        value: the number.
        samples: how many samples have it.
        runs: how many runs of samples have it.
        first: index of the first of them.
        usual: whether programs usually write it for missing values.
        off, usual_off: where a signal only drops to it: median distance of these samples from the
            line between their neighbours, and the standard deviation of that of all others; 0
            for a number that is far from all others.
    """

    value: float
    samples: int
    runs: int
    first: int
    usual: bool
    off: float = 0.0
    usual_off: float = 0.0


def missing_codes(values: FloatArray) -> list[Code]:
    """Find numbers that may stand for missing values, in finite values, shape (N,).

    Such a number is farther from all others than these are from each other. It is a usual code, or
    comes in several runs in a column that otherwise has many levels.
    """
    levels = np.unique(values)
    written = [level for level in levels if CODE.fullmatch(f"{level:.10g}")]
    rest = levels[~np.isin(levels, written)]
    if len(rest) < 2:
        return []
    codes = [_code(values, code, True) for code in written if _is_far_from(rest, code)]
    for end, others in ((rest[0], rest[1:]), (rest[-1], rest[:-1])):
        if len(others) >= LEVELS and _is_far_from(others, end):
            code = _code(values, end, False)
            codes += [code] if code.samples >= SEVERAL and code.runs >= SEVERAL else []
    return codes


DROPPED, DROPS = 5.0, 5
"""A sample drops if it is farther from the line between its neighbours than this number of
standard deviations; at least so many drop to one value, and those are most of all that drop."""


def dropouts(values: FloatArray) -> list[Code]:
    """Find the number to which finite values, (N,), drop again and again for a single sample.

    Sensors and loggers give 0, or their last zero, where a sample is lost: a number amid all
    others, that no smooth motion goes to and leaves at once.
    """
    if len(values) < LEVELS:
        return []
    off = np.zeros(len(values))
    off[1:-1] = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    moving = off[off > 0]
    usual = NORMAL * float(np.median(moving)) if len(moving) else 0.0
    higher = np.zeros(len(values), bool)
    higher[1:-1] = (off[1:-1] > off[:-2]) & (off[1:-1] > off[2:])
    drops = np.flatnonzero(higher & (off > DROPPED * usual))
    if len(drops) < DROPS:
        return []
    levels, counts = np.unique(values[drops], return_counts=True)
    value, count = float(levels[np.argmax(counts)]), int(counts.max())
    if count < DROPS or 2 * count <= len(drops):
        return []
    at = drops[values[drops] == value]
    return [Code(value, count, count, int(at[0]), False, float(np.median(off[at])), usual)]


def _is_far_from(levels: FloatArray, value: float) -> bool:
    """Tell whether a value is farther from levels, in order, than these are from each other."""
    return bool(max(levels[0] - value, value - levels[-1]) > levels[-1] - levels[0])


def _code(values: FloatArray, value: float, usual: bool) -> Code:
    where = np.flatnonzero(values == value)
    runs = 1 + int(np.count_nonzero(np.diff(where) > 1))
    return Code(float(value), len(where), runs, int(where[0]), usual)


MOSTLY = 0.8
"""At least this part of the distances between changes are the same, where a sensor holds."""

FEWEST_CHANGES = 20
"""A column that changes fewer times tells no rate."""


@dataclass(frozen=True, eq=False)
class Held:
    """A Held column changes only at even distances, since it is read at a lower rate.

    Attributes:
        period: mean number of samples from one change to the next.
        longest: how many samples in a row repeat the one before, as a rule.
        repeated: whether a sample repeats the one before, shape (N,).
    """

    period: float
    longest: int
    repeated: NDArray[np.bool_]


def held_samples(values: FloatArray) -> Held | None:
    """Find whether a sensor holds its values, shape (N,), or whether most are missing, evenly.

    A value that is not finite counts as repeated. Levels of a coarse rounding that are passed
    one after the other are no held values.
    """
    finite = np.isfinite(values)
    where = np.flatnonzero(finite)
    if len(where) < FEWEST_CHANGES:
        return None
    changed = np.concatenate([[True], np.diff(values[where]) != 0])
    changes = where[changed]
    sizes = np.abs(np.diff(values[changes]))
    if len(changes) < FEWEST_CHANGES:
        return None
    distances = np.diff(changes)
    usual = int(np.median(distances))
    is_usual = np.abs(distances - usual) <= (1 if usual > 2 else 0)
    if usual < 2 or np.mean(is_usual) < MOSTLY or np.median(sizes) < 1.5 * sizes.min():
        return None
    repeated = np.ones(len(values), bool)
    repeated[changes] = False
    period = float(distances[is_usual].mean())
    return Held(period, int(np.ceil(period - 1e-9)) - 1, repeated)


SPARSE, REGULARLY = 0.25, 0.25
"""A column has a rate of its own if more than the first part of its rows are empty, one by one,
and most of its values follow one another in the same time, up to the second part of it."""


@dataclass(frozen=True)
class OwnRate:
    """An OwnRate is the rate of a column that has values in some rows only.

    Attributes:
        step: usual time from one value to the next, in s.
        longest: how many rows in a row have none, as a rule.
        missing: part of the rows that have none.
    """

    step: float
    longest: int
    missing: float


def own_rate(time: FloatArray, values: FloatArray) -> OwnRate | None:
    """Find whether values, (N,), come at a rate of their own, at times in s, (N,)."""
    where = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    if len(where) < FEWEST_CHANGES or len(where) > (1 - SPARSE) * len(values):
        return None
    steps, rows = np.diff(time[where]), np.diff(where)
    usual = float(np.median(steps))
    regular = np.mean(np.abs(steps - usual) <= REGULARLY * usual)
    if usual <= 0 or regular < MOSTLY or np.mean(rows > 1) <= SPARSE:
        return None
    longest = int(np.quantile(rows, 0.99, method="higher")) - 1
    step = float(steps[np.abs(steps - usual) <= REGULARLY * usual].mean())
    return OwnRate(step, longest, 1 - len(where) / len(values))
