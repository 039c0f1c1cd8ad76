"""Where repeated periods begin and end: records may begin in the middle of one, or at rest.

Windows of one period that straddle two of them would be like neither, and share samples with both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.periods import groups_of_periods, standardized

APART = 0.3
"""A sample is not the one of a period later if its square differs by this part of the power."""
NOISE = 25.0
"""Nor if it differs by so many times the median of those that are."""
ROUNDING = 1e-12
"""Samples that differ by this part of the power are the same."""
LOOKED_AT = 0.25
"""Samples around, of this part of a period in all, tell whether it is chance that one is alike."""
MOST = 0.65
"""It is none if more than this part of them are alike: of samples of noise, a third are."""


@dataclass(frozen=True)
class WholePeriod:
    """A WholePeriod is a range of inputs, one period long or, with what comes again, longer.

    Attributes:
        piece: number of the piece of a record.
        begin, end: its inputs, the end excluded.
        number: those that are alike have one number; numbers rise as periods first come.
    """

    piece: int
    begin: int
    end: int
    number: int


def whole_periods(pieces: Sequence[FloatArray], period: int) -> list[WholePeriod]:
    """Find the periods in the inputs of pieces, (N, n_inputs) each, in their order.

    They begin where one period gives way to another. What is left behind the last whole one
    belongs to it if it goes on as it began; it is left out otherwise.
    """
    lengths = [len(piece) for piece in pieces]
    scaled = np.split(standardized(np.concatenate(pieces)), np.cumsum(lengths)[:-1])
    ranges = [
        (piece, begin, begin + period, end)
        for piece, values in enumerate(scaled)
        for low, high, end in _segments(values, period)
        for begin in range(low, high - period + 1, period)
    ]
    if not ranges:
        return []
    chosen = np.concatenate([scaled[piece][begin:end] for piece, begin, end, _ in ranges])
    numbers = groups_of_periods(chosen, period).tolist()
    return [
        WholePeriod(piece, begin, last if last - end < period else end, number)
        for (piece, begin, end, last), number in zip(ranges, numbers, strict=True)
    ]


def _segments(scaled: FloatArray, period: int) -> list[tuple[int, int, int]]:
    """Give begin and end of stretches in which no period gives way to another one.

    Third is the end of what goes on as it was one period before, where nothing is left over.
    """
    length = len(scaled)
    same = _come_again(scaled, period)
    edges = np.diff(same.astype(np.int8), prepend=0, append=0) if len(same) else np.empty(0)
    begins = np.flatnonzero(edges > 0)
    ends = np.flatnonzero(edges < 0) + period
    cuts = sorted({0, length, *begins.tolist(), *ends.tolist()})
    found = []
    for low, high in pairwise(cuts):
        rest = (high - low) % period
        goes_on = rest > 0 and bool(same[high - rest - period : high - period].all())
        found.append((low, high, high if goes_on else high - rest))
    return found


def _come_again(scaled: FloatArray, period: int) -> NDArray[np.bool_]:
    """Tell which samples come again one period later, shape (N - period,)."""
    if len(scaled) <= period or not scaled.shape[1]:
        return np.empty(0, bool)
    off = np.mean((scaled[period:] - scaled[:-period]) ** 2, axis=1)
    width = max(2, round(LOOKED_AT * period))
    same = _mostly(off <= APART, width)
    if same.any():
        level = min(APART, max(ROUNDING, NOISE * float(np.median(off[same]))))
        same = _mostly(off <= level, width)
    return same


def _mostly(flags: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    """Tell where most flags around are true; it changes where the fewest are on the wrong side."""
    total = np.concatenate([[0], np.cumsum(flags)])
    where = np.arange(len(flags))
    low, high = np.maximum(0, where - width // 2), np.minimum(len(flags), where + width // 2 + 1)
    most: NDArray[np.bool_] = (total[high] - total[low]) > MOST * (high - low)
    found: NDArray[np.bool_] = most.copy()
    for edge in (np.flatnonzero(np.diff(most.astype(np.int8))) + 1).tolist():
        begin = max(0, edge - width)
        right = np.where(flags[begin : edge + width] == most[edge], 1, -1)
        best = begin + int(np.argmax(np.append(np.cumsum(right[::-1])[::-1], 0)))
        found[best:edge] = most[edge]
        found[edge:best] = not most[edge]
    return found
