"""This module examines records for faults and remarks before anything is learnt from them.

Each rule is a row of a table, ``TIME_RULES`` or ``COLUMN_RULES``: the kind of a finding, a
function that describes it, the expected value, the remedy, and whether it is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import GIVE_STEP, Record
from slide_fmu.records.clock import EVEN, clock_of_record, drift
from slide_fmu.records.faults import outliers, quantization, saturations

EMPTY = 0.5
"""A column of which more than this part is empty is refused."""

COARSE = 1e-3
"""Rounding of more than this part of a column's standard deviation is remarked."""

LOST = 0.5
"""Clocks that drift apart by more than this part of a step over the record count as two."""

Severity = Literal["refused", "remarked"]


@dataclass(frozen=True)
class Finding:
    """A Finding is one fault of a record, or one remark about it.

    Attributes:
        kind: a word for it, such as ``"gap"`` or ``"saturation"``.
        severity: ``"refused"`` where nothing can be learnt before it is mended, else
            ``"remarked"``.
        path: the file.
        column: the column; empty where it is about several.
        found: the fault, with figures.
        expected: the expectation.
        remedy: the remedy.
    """

    kind: str
    severity: Severity
    path: str
    column: str
    found: str
    expected: str
    remedy: str

    @property
    def message(self) -> str:
        """Say it in one sentence."""
        column = f", column {self.column!r}" if self.column else ""
        return f"{self.path}{column}: {self.found}; expected {self.expected}: {self.remedy}"


@dataclass(frozen=True)
class Rule:
    """A Rule is a row of a table: a test of a column of a record, and the remedy.

    Attributes:
        kind, expected, remedy: as in ``Finding``.
        test: gives a sentence for each finding in the column of a record.
        refuses: whether a record with such a finding is refused; or a function that decides this
            for the record's column.
    """

    kind: str
    test: Callable[[Record, str], Iterable[str]]
    expected: str
    remedy: str
    refuses: bool | Callable[[Record, str], bool] = False

    def applied(self, record: Record, column: str) -> list[Finding]:
        """Return the findings of the rule in a column of a record."""
        refuses = self.refuses
        if not isinstance(refuses, bool):
            refuses = refuses(record, column)
        severity: Severity = "refused" if refuses else "remarked"
        about = record.path, column
        return [
            Finding(self.kind, severity, *about, fault, self.expected, self.remedy)
            for fault in self.test(record, column)
        ]


def examine(
    records: Sequence[Record], inputs: Sequence[str] = (), outputs: Sequence[str] = ()
) -> tuple[Finding, ...]:
    """Examine records of the same columns, in the order of the files.

    Args:
        records: at least one.
        inputs, outputs: columns that are examined; all columns where no name is given.

    Returns:
        The findings; those of severity ``"refused"`` must be corrected before anything is learnt.

    Raises:
        RecordError: a record lacks a column that is named.
    """
    names = (*inputs, *outputs) or tuple(records[0].columns)
    findings = [finding for record in records for finding in examine_alone(record, names)]
    without_unit = [
        one for record in records for one in TIME_WITHOUT_UNIT.applied(record, record.clock or "")
    ]
    findings += without_unit[:1]
    findings += [finding for name in names for finding in _constant(records, name)]
    return tuple(findings)


def examine_alone(record: Record, names: Sequence[str]) -> list[Finding]:
    """Examine the times and the named columns of one record.

    Raises:
        RecordError: the record lacks a column that is named.
    """
    record.chosen(tuple(names))
    clock = record.clock or ""
    findings = BROKEN_TIME.applied(record, clock)
    if not findings:
        findings += [one for rule in TIME_RULES for one in rule.applied(record, clock)]
        findings += [
            one for name in record.other_clocks for one in TWO_CLOCKS.applied(record, name)
        ]
    return findings + [
        one for name in names for rule in COLUMN_RULES for one in rule.applied(record, name)
    ]


def _constant(records: Sequence[Record], name: str) -> list[Finding]:
    """Refuse a column that has one value in all records."""
    known = np.concatenate([_finite(record, name)[0] for record in records])
    if not len(known) or known.min() < known.max():
        return []
    fault = f"the value is {records[0].with_unit(name, known[0])} in all samples"
    remedy = "leave the column out, or check its sensor"
    return [
        Finding("constant", "refused", records[0].path, name, fault, "a signal that moves", remedy)
    ]


def _finite(record: Record, name: str) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return the finite values of a column, and the numbers of their samples, (n,) each."""
    where = np.flatnonzero(np.isfinite(record.columns[name]))
    return record.columns[name][where], where


def _broken_times(record: Record, column: str) -> Iterable[str]:
    broken = np.flatnonzero(~np.isfinite(record.time))
    if len(broken):
        sample, what = int(broken[0]), "is empty or not finite"
        for text in record.texts:
            if text.column == column:
                sample, what = text.sample, f"has the text {text.value!r}"
        line = f" (line {record.first_line + sample})" if record.first_line else ""
        yield f"the time {what} at sample {sample + 1}{line}, {len(broken)} times in all"
    elif not (np.diff(record.time) > 0).any():
        yield f"the time never rises: {record.time[0]:.6g} s at all {len(record.time)} samples"


def _times_without_unit(record: Record, column: str) -> Iterable[str]:
    if column and not record.clock_unit and np.isfinite(record.time).all():
        duration = record.time[-1] - record.time[0]
        yield f"the times have no unit, and count as s: the record takes {duration:.6g} s"


def _falling_times(record: Record, _: str) -> Iterable[str]:
    falls = clock_of_record(record).falls
    if falls:
        by = record.time[falls[0] - 1] - record.time[falls[0]]
        yield (
            f"the time falls back by {by:.6g} s at {record.place(falls[0])}, {len(falls)} times "
            "in all"
        )


def _repeated_times(record: Record, _: str) -> Iterable[str]:
    repeats = clock_of_record(record).repeats
    if repeats:
        yield f"the time stays the same at {record.place(repeats[0])}, {len(repeats)} times in all"


def _gaps(record: Record, _: str) -> Iterable[str]:
    clock = clock_of_record(record)
    if clock.gaps:
        longest = max(clock.gaps, key=lambda gap: gap.length)
        missing = sum(round(gap.length / clock.step) - 1 for gap in clock.gaps)
        yield (
            f"{len(clock.gaps)} gaps, {missing} samples of {clock.step:.6g} s are missing; the "
            f"longest has {longest.length:.6g} s behind {record.place(longest.sample)}"
        )


def _jitter(record: Record, _: str) -> Iterable[str]:
    clock = clock_of_record(record)
    if clock.jitter > EVEN and not clock.falls and not clock.repeats:
        yield (
            f"times are off even ones by {100 * clock.jitter:.2g} % of the step "
            f"{clock.step:.6g} s (root mean square)"
        )


def _drifts(record: Record, column: str) -> Iterable[str]:
    off = drift(record.time, record.other_clocks[column])
    if not abs(off) <= LOST * clock_of_record(record).step:
        duration = float(record.time[-1] - record.time[0])
        yield f"this clock and {record.clock!r} drift apart by {off:.6g} s within {duration:.6g} s"


def _is_doubtful(record: Record, _: str) -> bool:
    return not record.clock_is_chosen


def _texts(record: Record, column: str) -> Iterable[str]:
    for text in record.texts:
        if text.column == column:
            place = record.place(text.sample)
            yield f"the text {text.value!r} at {place}, {text.count} texts in all"


def _empty(record: Record, column: str) -> Iterable[str]:
    finite = np.isfinite(record.columns[column])
    if finite.all() or any(text.column == column for text in record.texts):
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~finite, [False]])))
    lengths = edges[1::2] - edges[::2]
    longest = int(lengths.argmax())
    yield (
        f"{int(lengths.sum())} of {len(finite)} values are empty or not finite, in "
        f"{len(lengths)} ranges; the longest has {lengths[longest]} samples from "
        f"{record.place(int(edges[::2][longest]))}"
    )


def _is_mostly_empty(record: Record, column: str) -> bool:
    return bool(np.mean(~np.isfinite(record.columns[column])) > EMPTY)


def _saturated(record: Record, column: str) -> Iterable[str]:
    known, where = _finite(record, column)
    for limit in saturations(known):
        yield (
            f"{limit.samples} samples in {limit.runs} runs are exactly "
            f"{record.with_unit(column, limit.value)}, the first at "
            f"{record.place(int(where[limit.first]))}"
        )


def _outliers(record: Record, column: str) -> Iterable[str]:
    known, where = _finite(record, column)
    samples = outliers(known)
    if len(samples):
        first = int(samples[0])
        yield (
            f"{len(samples)} samples jump away from both neighbours, the first from "
            f"{known[first - 1]:.6g} to {record.with_unit(column, known[first])} at "
            f"{record.place(int(where[first]))}"
        )


def _coarse(record: Record, column: str) -> Iterable[str]:
    rounding = quantization(_finite(record, column)[0])
    if rounding is not None and rounding.noise > COARSE:
        yield (
            f"{rounding.levels} different values, in steps of "
            f"{record.with_unit(column, rounding.resolution)}; the rounding is "
            f"{100 * rounding.noise:.2g} % of the standard deviation"
        )


BROKEN_TIME = Rule(
    "time",
    _broken_times,
    "a finite number in s at every sample, and times that rise",
    f"mend or cut the file, name another column of times, or {GIVE_STEP}",
    refuses=True,
)
"""The rule about broken times; where it finds some, no other rule about times is applied."""

TIME_WITHOUT_UNIT = Rule(
    "unit",
    _times_without_unit,
    "a unit",
    'if they are in ms, call their column "time_ms"',
)
"""The rule about times of which 10 may be 10 ms; only the first such file is named."""

TIME_RULES = (
    Rule(
        "time falls back",
        _falling_times,
        "times that rise",
        f"cut the file there into several records, or {GIVE_STEP}",
        refuses=True,
    ),
    Rule(
        "time repeats",
        _repeated_times,
        "times that rise",
        f"remove samples that are there twice; if the clock is too coarse, {GIVE_STEP}",
        refuses=True,
    ),
    Rule("gap", _gaps, "even times", "the record is cut there into pieces"),
    Rule(
        "jitter",
        _jitter,
        f"at most {100 * EVEN:g} %",
        f"the record is resampled to even times; if only the stamps are off, {GIVE_STEP}",
    ),
)
"""Rules about the times of a record."""

TWO_CLOCKS = Rule(
    "two clocks",
    _drifts,
    "one clock for all columns",
    "name the one that the columns belong to (--time NAME in slide-fmu init, time in "
    "system.parameters of a recipe), and use no columns of the other",
    refuses=_is_doubtful,
)
"""The rule about each further column of times: to which clock do the values belong?"""

COLUMN_RULES = (
    Rule(
        "text",
        _texts,
        "numbers throughout",
        "mend the file, or leave the value empty: the record is cut there",
        refuses=True,
    ),
    Rule(
        "empty",
        _empty,
        "numbers throughout",
        "the record is cut there, if this is an input; no output counts there. Where more than "
        "half is empty, leave the column out, or record it anew",
        refuses=_is_mostly_empty,
    ),
    Rule(
        "saturation",
        _saturated,
        "a signal that turns before it reaches its extreme value",
        "use a wider range of the sensor; if the system itself stops there, all is well",
    ),
    Rule(
        "outlier",
        _outliers,
        "differences like those around it",
        "they are left out of the linear fit that the window follows from, but learnt from: leave "
        "these values empty if they are faults of the measurement",
    ),
    Rule(
        "quantization",
        _coarse,
        f"at most {100 * COARSE:g} %",
        "errors below this cannot be measured; record or write more digits",
    ),
)
"""Rules about the values of a column."""
