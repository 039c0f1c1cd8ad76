"""What is found about the times of a record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.records.clock import EVEN, Clock, clock_of_record, drift
from slide_fmu.records.finding import Finding
from slide_fmu.records.record import GIVE_STEP, Record

LOST = 0.5
"""Two clocks that drift apart by more than this part of a step over the record are two."""


def time_findings(record: Record) -> list[Finding]:
    """Find what is wrong with the times: texts, jumps, gaps, jitter, another clock that drifts."""
    broken = np.flatnonzero(~np.isfinite(record.time))
    if len(broken):
        return [_broken(record, broken)]
    if not (np.diff(record.time) > 0).any():
        return [_still(record)]
    clock = clock_of_record(record)
    return [
        *_order(record, clock),
        *_gaps(record, clock),
        *_other_clocks(record, clock),
        *_jitter(record, clock),
    ]


def clock_unit_findings(records: Sequence[Record]) -> list[Finding]:
    """Remark once that times have no unit, of which 10 may be 10 ms; name the first such file."""
    silent = [
        record
        for record in records
        if record.clock is not None and not record.clock_unit and np.isfinite(record.time).all()
    ]
    if not silent:
        return []
    first = silent[0]
    more = f", nor those of {len(silent) - 1} more files" if len(silent) > 1 else ""
    found = (
        f"the times have no unit{more}, and count as s: the record takes "
        f"{first.time[-1] - first.time[0]:.6g} s"
    )
    remedy = 'if they are in ms, call their column "time_ms"'
    return [Finding("unit", "remarked", first.path, first.clock or "", found, "a unit", remedy)]


def _finding(record: Record, kind: str, found: str, expected: str, remedy: str) -> Finding:
    return Finding(kind, "refused", record.path, record.clock or "", found, expected, remedy)


def _broken(record: Record, broken: np.ndarray) -> Finding:
    texts = [text for text in record.texts if text.column == record.clock]
    if texts:
        sample, what = texts[0].sample, f"has the text {texts[0].value!r}"
    else:
        sample, what = int(broken[0]), "is empty or not finite"
    line = f" (line {record.first_line + sample})" if record.first_line else ""
    return _finding(
        record,
        "time",
        f"the time {what} at sample {sample + 1}{line}, {len(broken)} times in all",
        "a number in s at every sample",
        f"mend or cut the file, or {GIVE_STEP}",
    )


def _still(record: Record) -> Finding:
    return _finding(
        record,
        "time",
        f"the time never rises: {record.time[0]:.6g} s at all {len(record.time)} samples",
        "rising times in s",
        f"name another column of times, or {GIVE_STEP}",
    )


def _order(record: Record, clock: Clock) -> list[Finding]:
    """Refuse times that fall back or repeat."""
    found = []
    if clock.falls:
        at = clock.falls[0]
        found.append(
            _finding(
                record,
                "time falls back",
                f"the time falls back by {record.time[at - 1] - record.time[at]:.6g} s at "
                f"{record.place(at)}, {len(clock.falls)} times in all",
                "times that rise",
                f"cut the file there into several records, or {GIVE_STEP}",
            )
        )
    if clock.repeats:
        found.append(
            _finding(
                record,
                "time repeats",
                f"the time stays the same at {record.place(clock.repeats[0])}, "
                f"{len(clock.repeats)} times in all",
                "times that rise",
                f"remove samples that are there twice; if the clock is too coarse, {GIVE_STEP}",
            )
        )
    return found


def _gaps(record: Record, clock: Clock) -> list[Finding]:
    """Remark where samples are missing."""
    if not clock.gaps:
        return []
    longest = max(clock.gaps, key=lambda gap: gap.length)
    missing = sum(round(gap.length / clock.step) - 1 for gap in clock.gaps)
    found = (
        f"{len(clock.gaps)} gaps, {missing} samples of {clock.step:.6g} s are missing; the "
        f"longest has {longest.length:.6g} s behind {record.place(longest.sample)}"
    )
    remedy = "the record is cut there into stretches"
    return [
        Finding("gap", "remarked", record.path, record.clock or "", found, "even times", remedy)
    ]


def _other_clocks(record: Record, clock: Clock) -> list[Finding]:
    """Refuse a second clock that drifts, unless one is chosen: to which do the values belong?"""
    found = []
    duration = float(record.time[-1] - record.time[0])
    for name, times in record.other_clocks.items():
        off = drift(record.time, times)
        if not abs(off) <= LOST * clock.step:
            found.append(
                Finding(
                    "two clocks",
                    "remarked" if record.clock_is_chosen else "refused",
                    record.path,
                    name,
                    f"this clock and {record.clock!r} drift apart by {off:.6g} s within "
                    f"{duration:.6g} s",
                    "one clock for all columns",
                    "name the one that the columns belong to (--time NAME in slide-fmu init, time "
                    "in system.parameters of a recipe), and use no columns of the other",
                )
            )
    return found


def _jitter(record: Record, clock: Clock) -> list[Finding]:
    """Remark times that are off even ones, unless they are refused."""
    if clock.jitter <= EVEN or clock.falls or clock.repeats:
        return []
    found = (
        f"times are off even ones by {100 * clock.jitter:.2g} % of the step "
        f"{clock.step:.6g} s (root mean square)"
    )
    expected = f"at most {100 * EVEN:g} %"
    remedy = f"the record is resampled to even times; if only the stamps are off, {GIVE_STEP}"
    name = record.clock or ""
    return [Finding("jitter", "remarked", record.path, name, found, expected, remedy)]
