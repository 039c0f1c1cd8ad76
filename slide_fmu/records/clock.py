"""This module examines the times of a record: step, jitter, gaps and falls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import GIVE_STEP, Record, RecordError

GAP = 1.5
"""Samples with a distance of more than this many steps have a gap between them."""

OFF_WHOLE, UNEVEN, WIDE = 0.25, 0.1, 3.0
"""A clock is uneven if more than the second part of its distances are off whole steps by more than
the first. Its gaps are distances of more than ``WIDE`` times what nineteen in twenty have: of
random distances, such as those between events, hardly any is that wide."""

EVEN = 0.01
"""Times whose jitter is below this part of the step count as even."""


@dataclass(frozen=True)
class Gap:
    """A Gap lies behind a sample.

    Attributes:
        sample: index of the last sample before it.
        length: time between the samples around it, in s.
    """

    sample: int
    length: float


@dataclass(frozen=True)
class Clock:
    """A Clock describes how even the times of a record are.

    Attributes:
        step: sample step in s: the slope of the times over the sample number, in all pieces
            together; where times fall back, the mean of the differences near their median.
        jitter: root mean square of the differences between the times and even times, in steps.
            Each piece between two gaps has its own even times, with the best offset.
        gaps: where samples are missing.
        falls: indices of samples whose time is before that of the sample before.
        repeats: indices of samples whose time is that of the sample before.
        uneven: whether the distances differ throughout, so that no sample counts as lost.
    """

    step: float
    jitter: float
    gaps: tuple[Gap, ...]
    falls: tuple[int, ...]
    repeats: tuple[int, ...]
    uneven: bool = False

    def pieces(self, length: int) -> list[tuple[int, int]]:
        """Return begin and end (excluded) of the pieces between gaps, of ``length`` samples."""
        cuts = [gap.sample + 1 for gap in self.gaps]
        return list(zip([0, *cuts], [*cuts, length], strict=True))

    def longest(self, length: int) -> int:
        """Return the length of the longest piece between gaps, of ``length`` samples."""
        return max(end - begin for begin, end in self.pieces(length))


def clock_of_record(record: Record) -> Clock:
    """Find step, jitter, gaps and falls of the times of a record.

    Raises:
        RecordError: a time is not finite, or none rises; the message names file and place.
    """
    return clock_of(record.time, lambda sample: f"{record.path}, {record.place(sample)}")


def _numbered(sample: int) -> str:
    return f"sample {sample + 1}"


def clock_of(time: FloatArray, place: Callable[[int], str] = _numbered) -> Clock:
    """Find step, jitter, gaps and falls of times in s, shape (N,), of at least two samples.

    Messages name a sample as ``place`` does, with its file.

    Raises:
        RecordError: a time is not finite, or none rises.
    """
    _require_finite(time, place)
    differences = np.diff(time)
    rising = differences[differences > 0]
    if not len(rising):
        raise RecordError(
            f"{place(0)}: none of {len(time)} times rises; expected times that rise: mend the "
            f"time, or {GIVE_STEP}"
        )
    median = float(np.median(rising))
    step = float(rising[np.abs(rising - median) <= 0.5 * median].mean())
    behind = np.flatnonzero(differences > GAP * step)
    gaps = tuple(Gap(int(sample), float(differences[sample])) for sample in behind)
    falls = tuple(int(k) + 1 for k in np.flatnonzero(differences < 0))
    repeats = tuple(int(k) + 1 for k in np.flatnonzero(differences == 0))
    off_whole = np.abs(rising / step - np.maximum(1, np.round(rising / step))) > OFF_WHOLE
    uneven = bool(np.mean(off_whole) > UNEVEN)
    if uneven:
        widest = WIDE * float(np.quantile(rising, 0.95))
        gaps = tuple(gap for gap in gaps if gap.length > widest)
    rough = Clock(step, 0.0, gaps, falls, repeats, uneven)
    fine = replace(rough, step=step if falls else _slope(time, rough))
    return replace(fine, jitter=_jitter(time, fine))


def _require_finite(time: FloatArray, place: Callable[[int], str]) -> None:
    """Refuse times that are missing, are texts, or are not finite."""
    wrong = np.flatnonzero(~np.isfinite(time))
    if len(wrong):
        raise RecordError(
            f"{place(int(wrong[0]))}: the time is no finite number, as {len(wrong)} of "
            f"{len(time)} are; expected finite times that rise: mend the time, or {GIVE_STEP}"
        )


def _slope(time: FloatArray, clock: Clock) -> float:
    """Fit one step to all pieces by least squares; each piece has its own offset."""
    products = squares = 0.0
    for begin, end in clock.pieces(len(time)):
        number = np.arange(end - begin) - 0.5 * (end - begin - 1)
        products += float(number @ (time[begin:end] - time[begin]))
        squares += float(number @ number)
    return products / squares if squares else clock.step


def _jitter(time: FloatArray, clock: Clock) -> float:
    """Compute the root mean square of the differences from even times, in steps."""
    squares = 0.0
    for begin, end in clock.pieces(len(time)):
        off = time[begin:end] - time[begin] - clock.step * np.arange(end - begin)
        squares += float(np.sum((off - off.mean()) ** 2))
    return float(np.sqrt(squares / len(time))) / clock.step


def drift(time: FloatArray, other: FloatArray) -> float:
    """Compute the drift between two clocks in s, over the time from the first sample to the last.

    It is the slope of the line through the differences of both, shape (N,) each, times the
    duration; NaN where fewer than two samples have both times.
    """
    both = np.isfinite(time) & np.isfinite(other)
    if np.count_nonzero(both) < 2:
        return float("nan")
    elapsed, apart = time[both] - time[both].mean(), other[both] - time[both]
    power = float(elapsed @ elapsed)
    slope = float(elapsed @ (apart - apart.mean())) / power if power else 0.0
    return slope * float(time[both][-1] - time[both][0])


def neat_step(clock: Clock, length: int) -> float:
    """Return the step of a clock in s, rounded as far as ``length`` steps allow."""
    for digits in range(1, 13):
        step = float(f"{clock.step:.{digits}g}")
        if abs(step / clock.step - 1) * length < EVEN:
            return step
    return clock.step
