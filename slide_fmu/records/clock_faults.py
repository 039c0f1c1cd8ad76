"""This module says in what way times of a record are wrong, as loggers make them.

Counters begin anew, clocks are set back, stamps have too few digits, or are those at which packets
arrive. Where the samples themselves are even, their step is found.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.clock import Clock

BITS = (8, 10, 12, 15, 16, 20, 24, 31, 32)
"""A counter of so many bits begins anew after 2 to this power."""
ROUND = {60.0: "a minute", 3600.0: "an hour", 43200.0: "half a day", 86400.0: "a day"}
"""Times in s after which clocks begin anew, or by which they are set."""
NEAR = 1.5
"""Times are the same if they are less than this many steps apart."""
OFTEN = 0.1
"""A clock is too coarse if at least this part of its times stays the same."""
STAMPS = 10
"""Least number of different times that tell a step."""
ALIKE = 0.1
"""Distances are alike up to this part of them."""
FEWEST, SLOWER = 10, 20
"""Least number of bursts, and of equal gaps in a row that make another rate."""


@dataclass(frozen=True)
class ClockFault:
    """A ClockFault is a fault of times.

    Attributes:
        found: the fault, with figures.
        expected: the expectation.
        remedy: the remedy; empty where it is the usual one.
        step: the sample step in s, if the samples themselves are even; else None.
    """

    found: str
    expected: str
    remedy: str = ""
    step: float | None = None


def why_it_falls(time: FloatArray, clock: Clock, unit: float) -> ClockFault:
    """Say how times, (N,), fall back for the first time; ``unit`` is what they count in, in s."""
    first, step = clock.falls[0], clock.step
    back = float(time[first - 1] - time[first])
    rises, after = back + step, "as a clock that is set back"
    even = step if _is_even(time, clock) else None
    for place in (first - 1, first):
        if 0 < place < len(time) - 1 and 0 < time[place + 1] - time[place - 1] < 3 * step:
            return ClockFault(
                f"{time[place]:.6g} s stands between {time[place - 1]:.6g} and "
                f"{time[place + 1]:.6g} s: this time is wrong, or rows have changed places",
                "rows in the order of time",
                "mend this time, or sort the rows",
            )
    bits = next((b for b in BITS if abs(rises - unit * 2**b) < NEAR * step), None)
    usual = next((words for size, words in ROUND.items() if abs(rises - size) < NEAR * step), None)
    if bits is not None:
        after = f"as a counter of {bits} bits that begins anew every {unit * 2**bits:.6g} s"
    elif abs(time[first] - time[0]) < NEAR * step:  # a record may last a minute, too
        return ClockFault(
            f"the times begin anew there, at {time[first]:.6g} s: the file holds "
            f"{len(clock.falls) + 1} records behind one another",
            "one record in a file",
            "cut the file there",
        )
    elif usual is not None:
        after = f"by {usual}: a clock that begins anew, or one that is set back"
    return ClockFault(f"it goes on {after}", "times that rise", step=even)


def rows_again(rows: FloatArray, clock: Clock) -> ClockFault | None:
    """Say that where times fall back, rows are there twice; None unless that is all.

    Args:
        rows: times in s, and then the other columns, shape (N, n).
        clock: of these times.
    """
    time, again = rows[:, 0], 0
    for fall in clock.falls:
        before = np.flatnonzero(time[:fall] == time[fall])
        count = 0 if len(before) == 0 else fall - int(before[-1])
        same = rows[fall - count : fall], rows[fall : fall + count]
        if count == 0 or not np.array_equal(*same, equal_nan=True):
            return None
        again += count
    return ClockFault(
        f"{again} rows are there twice, the first of them from there on",
        "each row once",
        "remove the second of them",
    )


def _is_even(time: FloatArray, clock: Clock) -> bool:
    """Tell whether nearly all distances are alike but at the falls."""
    distances = np.delete(np.diff(time), [fall - 1 for fall in clock.falls])
    return float(np.mean(np.abs(distances / clock.step - 1) < ALIKE)) > 0.99


def why_it_repeats(time: FloatArray) -> ClockFault | None:
    """Say that times, (N,), have too few digits; None where a few rows are there twice."""
    stamps = np.unique(time)
    same = 1 - len(stamps) / len(time)
    if same < OFTEN or len(stamps) < 2:
        return None
    resolution = float(np.median(np.diff(stamps)))
    step = None
    if len(stamps) >= STAMPS:
        number = np.arange(len(time)) - 0.5 * (len(time) - 1)
        digits = int(math.log10(len(stamps)))  # as many as the stamps tell
        step = float(f"{number @ (time - time.mean()) / (number @ number):.{digits}g}")
    every = len(time) / len(stamps)
    return ClockFault(
        f"there are only {len(stamps)} different times, {resolution:.6g} s apart, for "
        f"{len(time)} samples, {every:.3g} for each: the clock is too coarse, or samples have the "
        "time of their packet",
        "a time for each sample",
        step=step,
    )


def bursts(time: FloatArray, clock: Clock) -> ClockFault | None:
    """Say that rising times, (N,), are those at which packets of samples arrive; else None."""
    starts = np.array([0, *(gap.sample + 1 for gap in clock.gaps)])
    if len(starts) <= FEWEST or clock.falls or clock.repeats:
        return None
    sizes, pauses = np.diff(starts), np.diff(time[starts])
    usual, pause = float(np.median(sizes)), float(np.median(pauses))
    regular = np.mean(sizes == usual) > 0.9 and np.mean(np.abs(pauses / pause - 1) < ALIKE) > 0.9
    if usual < 2 or not regular or pause < 2 * usual * clock.step:
        return None
    return ClockFault(
        f"samples come in bursts of {usual:.0f} that are {clock.step:.3g} s apart, one burst "
        f"every {pause:.6g} s: these are times of arrival",
        "the times at which samples were taken",
        step=float(f"{pause / usual:.3g}"),
    )


def slower_from(samples: Sequence[int], lost: Sequence[int]) -> tuple[int, int] | None:
    """Return where a record goes on at a slower rate, and its step there in steps; or None.

    Args:
        samples: samples before gaps, rising.
        lost: number of samples that each gap lacks.
    """
    if len(samples) < SLOWER:
        return None
    follows = (np.diff(samples) == 1) & (np.diff(lost) == 0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], follows, [False]]))).reshape(-1, 2)
    if not len(edges):
        return None
    begin, end = edges[np.argmax(edges[:, 1] - edges[:, 0])]
    return (int(samples[begin]), lost[begin] + 1) if end - begin >= SLOWER else None
