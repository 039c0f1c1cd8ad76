"""This module examines records for faults and remarks before anything is learnt from them.

Each rule is a row of a table, ``TIME_RULES`` or ``COLUMN_RULES``: the kind of a finding, a
function that describes it, the expected value, the remedy, and whether it is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import GIVE_STEP, Record, RecordError, files_named
from slide_fmu.record_files.table import SECONDS
from slide_fmu.records.clock import EVEN, clock_of_record, drift
from slide_fmu.records.clock_faults import (
    ClockFault,
    bursts,
    rows_again,
    slower_from,
    why_it_falls,
    why_it_repeats,
)
from slide_fmu.records.faults import (
    STUCK,
    Code,
    dropouts,
    held_samples,
    missing_codes,
    outliers,
    own_rate,
    quantization,
    saturations,
    stuck,
)
from slide_fmu.records.filling import lost_rows, runs_of

EMPTY = 0.5
"""A column of which more than this part is empty is refused."""

COARSE = 1e-3
"""Rounding of more than this part of a column's standard deviation is remarked."""

LOST = 0.5
"""Clocks that drift apart by more than this part of a step over the record count as two."""

FILL = (
    "--read fill=N in slide-fmu init, fill = N in system.parameters of a recipe, fills up to N "
    "samples in a row"
)
"""The remedy for samples that are missing singly."""

MOST_FILLED, MOST_GAPS = 10, 0.9
"""Filling is proposed if the part MOST_GAPS of the gaps lack at most MOST_FILLED samples each."""

MOST_SAME = 2
"""A number is proposed as missing if all columns have at most this many times as many of it."""

MOVING = 0.2
"""A column moves where its deviation is above this part of that of the whole column."""

OF_FILE = (
    *("gap", "uneven clock", "jitter", "far value", "held", "empty", "outlier"),
    *("unmoved", "dead time", "set points", "stuck"),
)
"""Kinds of findings that may pass for properties of the machine."""

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
        keys: keys of ``system.parameters`` that would mend it.
        step: sample step in s that belongs to these keys; None where it may stay.
    """

    kind: str
    severity: Severity
    path: str
    column: str
    found: str
    expected: str
    remedy: str
    keys: Mapping[str, float] = field(default_factory=dict)
    step: float | None = None

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
    findings = [one for record in records for one in examine_alone(record, names, outputs)]
    without_unit = [
        one for record in records for one in TIME_WITHOUT_UNIT.applied(record, record.clock or "")
    ]
    findings += without_unit[:1]
    findings += [finding for name in names for finding in _constant(records, name)]
    return tuple(findings)


def messages(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Return one sentence for findings of one kind in one column; further files are only named."""
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        alike.setdefault((finding.severity, finding.kind, finding.column), []).append(finding)
    said = []
    for group in alike.values():
        first, paths = group[0], list(dict.fromkeys(finding.path for finding in group))
        said += [one.message for one in group if one.path == first.path]
        if len(paths) > 1:
            said[-1] += f". The same is so in {files_named(paths[1:])}"
    return tuple(said)


def require_sound(findings: Iterable[Finding]) -> None:
    """Refuse records with faults that must be mended first.

    Raises:
        RecordError: a line for each such fault.
    """
    refused = [finding for finding in findings if finding.severity == "refused"]
    if refused:
        raise RecordError("\n".join(messages(refused)))


def examine_alone(
    record: Record, names: Sequence[str], outputs: Sequence[str] = ()
) -> list[Finding]:
    """Examine the times and the named columns of one record, some of which are outputs.

    Numbers that may stand for missing values are no other fault.

    Raises:
        RecordError: the record lacks a column that is named.
    """
    record.chosen(tuple(names))
    clock = record.clock or ""
    findings = BROKEN_TIME.applied(record, clock)
    if not findings:
        order = _out_of_order(record)
        findings += order
        findings += [one for rule in TIME_RULES for one in rule.applied(record, clock)]
        findings += [] if order else _gaps(record)
        findings += [
            one for name in record.other_clocks for one in TWO_CLOCKS.applied(record, name)
        ]
    for name in names:
        codes = _codes(record, name, names)
        findings += [finding for finding, _ in codes]
        rest = _without(record, name, [value for _, value in codes])
        findings += [one for rule in COLUMN_RULES for one in rule.applied(rest, name)]
        refused = [value for finding, value in codes if finding.severity == "refused"]
        findings += _empty(_without(record, name, refused), name)  # others count as measured
        findings += _other_rate(rest, name, names, outputs)
        if name in outputs and own_rate(rest.time, rest.columns[name]) is None:
            findings += _held(rest, name)
        if outputs and record.stuck is None:
            inputs = [one for one in names if one not in outputs]
            findings += _stuck(rest, name, inputs, outputs)
    return findings


def _codes(record: Record, name: str, names: Sequence[str]) -> list[tuple[Finding, float]]:
    """Return findings on numbers that may stand for missing values, with these numbers.

    The key is about all columns, so that it would take a 0 at which another one rests, too.
    """
    known, where = _finite(record, name)
    findings = []
    for code in missing_codes(known) or dropouts(known):
        fault = (
            f"{_counted(code.samples, 'sample')} in {_counted(code.runs, 'run')} "
            f"{'is' if code.samples == 1 else 'are'} exactly {code.value:.10g}, the first at "
            f"{record.place(int(where[code.first]))}, and {_others(known, code)}"
        )
        key = f"missing={code.value:.10g}"
        remedy = (
            f"if it stands for missing values, say so: --read {key} in slide-fmu init, "
            f"{key.replace('=', ' = ')} in system.parameters of a recipe"
        )
        about: tuple[str, Severity] = (
            ("code", "refused") if code.usual else ("far value", "remarked")
        )
        keys = {"missing": code.value}
        same = sum(int(np.count_nonzero(record.columns[one] == code.value)) for one in names)
        if not code.usual and same > MOST_SAME * code.samples:
            remedy = (
                "if it stands for missing values, leave these empty in the file: the key missing "
                f"would take {_counted(same - code.samples, 'further sample')} with this number"
            )
            keys = {}
        finding = Finding(*about, record.path, name, fault, "measured values", remedy, keys)
        findings.append((finding, code.value))
    return findings


def _others(values: FloatArray, code: Code) -> str:
    """Say how a code differs from all other values."""
    if code.off:
        return (
            f"jump there by {code.off:.3g} from both sides (median), where {code.usual_off:.3g} "
            "is usual"
        )
    rest = values[values != code.value]
    return f"all others lie in {rest.min():.6g} .. {rest.max():.6g}"


def _without(record: Record, name: str, codes: Sequence[float]) -> Record:
    """Return a record without some numbers in a column; the same record without any."""
    if not codes:
        return record
    values = record.columns[name]
    left = np.where(np.isin(values, codes), np.nan, values)
    return replace(record, columns={**record.columns, name: left})


def _held(record: Record, name: str) -> list[Finding]:
    """Remark an output that its sensor holds while the rest of the record goes on."""
    held = held_samples(record.columns[name])
    if held is None or held.longest <= record.fill:
        return []
    every = f"every {held.period:.3g} samples"
    fault = f"it changes {every} only, while the record goes on: its sensor holds what it reads"
    step = held.period * clock_of_record(record).step
    return [_slow(record, name, "remarked", fault, step, held.longest)]


def _slow(
    record: Record, name: str, severity: Severity, fault: str, own: float, longest: int
) -> Finding:
    """Return the finding of a column that is slower than the record, with a step of its own."""
    step = float(f"{own:.3g}")
    remedy = (
        f"record it at the rate of the others, or take its step, and a smooth curve through what "
        f"was read anew: --step {step:g} --read fill={longest} in slide-fmu init, "
        f"window.step = {step:g} and fill = {longest} in system.parameters of a recipe"
    )
    about = record.path, name, fault, "a new value at every sample", remedy
    return Finding("held", severity, *about, {"fill": longest}, step)


def _other_rate(
    record: Record, name: str, names: Sequence[str], outputs: Sequence[str]
) -> list[Finding]:
    """Find a column whose values come at a rate of their own, or in rows of their own.

    An input is refused, since the record would be cut at each row without it.
    """
    rates = {one: own_rate(record.time, record.columns[one]) for one in names}
    rate = rates[name]
    if rate is None or rate.longest <= record.fill:
        return []
    fault = f"it has a value every {_rate(rate.step)} only"
    others = [one for one in names if one != name]
    if others:
        count = [np.count_nonzero(np.isfinite(record.columns[one])) for one in others]
        other = others[int(np.argmax(count))]
        times = record.time[np.isfinite(record.columns[other])]
        usual = float(np.median(np.diff(times))) if len(times) > 1 else rate.step
        fault = f"{fault}, and {other!r} every {_rate(usual)}: the file has two rates"
        if usual > SAME_RATE * rate.step:
            fault = (
                f"it has no value in {100 * rate.missing:.2g} % of the rows, those of {other!r} "
                "between its own: rows of several clocks follow one another"
            )
    usable = name in outputs and not _is_mostly_empty(record, name)
    severity: Severity = "remarked" if usable else "refused"
    known = [one for one in rates.values() if one is not None]  # one remedy mends all of them
    step, longest = max(one.step for one in known), max(one.longest for one in known)
    return [_slow(record, name, severity, fault, step, longest)]


def _rate(step: float) -> str:
    return f"{step:.3g} s ({1 / step:.3g} Hz)"


def _stuck(
    record: Record, name: str, inputs: Sequence[str], outputs: Sequence[str]
) -> list[Finding]:
    """Find a sensor that stands still while the machine goes on.

    Refused is an output that stays while an input moves, and the inputs that all stay while the
    outputs move on; of several inputs, one alone may rest. An output may rest at the start.
    """
    run = stuck(record.columns[name])
    if run is None:
        return []
    begin, end = run
    others = [one for one in inputs if one != name]
    moves = [one for one in others if _moves(record, one, begin, end)]
    if name in outputs and (begin == 0 or not moves):
        return []
    later = (begin + end) // 2  # what came before the run is forgotten there, or nearly so
    going_on = [one for one in outputs if _moves(record, one, later, end)]
    if name not in outputs and not going_on:
        return []
    severity: Severity = "refused" if name in outputs or not moves else "remarked"
    still = record.with_unit(name, record.columns[name][begin])
    fault = (
        f"it is exactly {still} at {end - begin} samples in a row from {record.place(begin)}, "
        f"where {(moves if name in outputs else going_on)[0]!r} moves, and hardly ever has one "
        "value twice elsewhere: its sensor stands still"
    )
    remedy = (
        f"if so, say it: --read stuck={STUCK} in slide-fmu init, stuck = {STUCK} in "
        "system.parameters of a recipe; then values count as missing from so many equal ones in a "
        "row on. If it is right as it is: stuck = 0"
    )
    keys = {"stuck": STUCK}
    expected = "a signal that moves with the others"
    return [Finding("stuck", severity, record.path, name, fault, expected, remedy, keys)]


def _moves(record: Record, name: str, begin: int, end: int) -> bool:
    """Tell whether a column moves within some samples, as it does elsewhere."""
    values = record.columns[name]
    part, whole = values[begin:end], values[np.isfinite(values)]
    part = part[np.isfinite(part)]
    return len(part) > 1 and float(part.std()) > MOVING * float(whole.std())


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
        times = _counted(len(broken), "time")
        yield f"the time {what} at sample {sample + 1}{line}, {times} in all"
    elif (np.diff(record.time) < 0).all():
        ends = f"from {record.time[0]:.6g} to {record.time[-1]:.6g} s"
        yield f"the time never rises, and falls throughout, {ends}: the rows are in reverse order"
    elif not (np.diff(record.time) > 0).any():
        yield (
            f"the time never rises: it begins at {record.time[0]:.6g} s and ends at "
            f"{record.time[-1]:.6g} s after {len(record.time)} samples: a clock that stands, or "
            "has too few digits"
        )


def _times_without_unit(record: Record, column: str) -> Iterable[str]:
    if column and not record.clock_unit and np.isfinite(record.time).all():
        duration = record.time[-1] - record.time[0]
        yield f"the times have no unit, and count as s: the record takes {duration:.6g} s"


def _out_of_order(record: Record) -> list[Finding]:
    """Refuse times that fall back, repeat, or are those at which packets of samples arrive."""
    clock, findings = clock_of_record(record), list[Finding]()
    unit = SECONDS.get(record.clock_unit, 1.0)
    if clock.falls:
        by = record.time[clock.falls[0] - 1] - record.time[clock.falls[0]]
        rows = np.column_stack([record.time, *record.columns.values()])
        fault = rows_again(rows, clock) or why_it_falls(record.time, clock, unit)
        said = (
            f"the time falls back by {by:.6g} s at {record.place(clock.falls[0])}, "
            f"{_counted(len(clock.falls), 'time')} in all; {fault.found}"
        )
        usual = "cut the file there into several records, or "
        findings.append(_of_clock(record, "time falls back", said, fault, usual))
    if clock.repeats:
        said = (
            f"the time stays the same at {record.place(clock.repeats[0])}, "
            f"{_counted(len(clock.repeats), 'time')} in all"
        )
        coarse = why_it_repeats(record.time)
        if coarse is not None:
            said = f"{said}; {coarse.found}"
        fault = coarse or ClockFault(
            said, "times that rise", "remove samples that are there twice"
        )
        findings.append(_of_clock(record, "time repeats", said, fault))
    packets = bursts(record.time, clock)
    if packets is not None:
        findings.append(_of_clock(record, "bursts", packets.found, packets))
    return findings


def _of_clock(
    record: Record, kind: str, found: str, fault: ClockFault, usual: str = ""
) -> Finding:
    """Return the finding of a fault of the clock, with the step as its key if that is known."""
    step = None if fault.step is None else float(f"{fault.step:.6g}")
    known = f", here {step:g}" if step is not None else ""
    remedy = fault.remedy or f"{usual}{GIVE_STEP}{known}"
    keys = {} if step is None else {"sample_step": step}
    about = record.path, record.clock or "", found, fault.expected, remedy
    return Finding(kind, "refused", *about, keys, step)


def _gaps(record: Record) -> list[Finding]:
    """Remark lost samples; a few in a row can be filled."""
    clock = clock_of_record(record)
    filled = {sample for sample, _ in lost_rows(record)}
    gaps = [gap for gap in clock.gaps if gap.sample not in filled]
    if not gaps:
        return []
    longest = max(gaps, key=lambda gap: gap.length)
    lost = [round(gap.length / clock.step) - 1 for gap in gaps]
    singly = f"{lost.count(1)} of them singly"
    are = "is" if sum(lost) == 1 else "are"
    missing = f", {_counted(sum(lost), 'sample')} of {clock.step:.6g} s {are} missing, {singly}"
    if clock.uneven:
        missing = ""
    fault = (
        f"{_counted(len(gaps), 'gap')}{missing}; the longest has {longest.length:.6g} s behind "
        f"{record.place(longest.sample)}, and the longest piece between gaps has "
        f"{clock.longest(len(record.time))} of {len(record.time)} samples"
    )
    slower = slower_from([gap.sample for gap in gaps], lost)
    if slower is not None:
        sample, times = slower
        fault = f"{fault}; from {record.place(sample)} on, it has {times} times the step"
    more, keys = _filling(lost)
    remedy = f"the record is cut there into pieces{more}"
    about = record.path, record.clock or ""
    return [Finding("gap", "remarked", *about, fault, "even times", remedy, keys)]


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _filling(lengths: Sequence[int]) -> tuple[str, dict[str, float]]:
    """Return the end of a remedy, and the key, that fill most runs of missing samples."""
    usual = int(np.ceil(np.quantile(lengths, MOST_GAPS)))
    if usual > MOST_FILLED:
        return "", {}
    return f"; {FILL}, here {usual}", {"fill": usual}


def _filled(record: Record, _: str) -> Iterable[str]:
    gaps = lost_rows(record)
    if gaps:
        rows = sum(count for _, count in gaps)
        are = "is" if rows == 1 else "are"
        yield f"{_counted(rows, 'lost sample')} in {_counted(len(gaps), 'gap')} {are} filled"


def _uneven(record: Record, _: str) -> Iterable[str]:
    clock = clock_of_record(record)
    if clock.uneven and not clock.falls and not clock.repeats:
        steps = np.diff(record.time)
        low, middle, high = np.quantile(steps, (0.05, 0.5, 0.95))
        yield (
            f"the clock is uneven: samples are {steps.min():.3g} s to {steps.max():.3g} s apart, "
            f"nine in ten of them {low:.3g} s to {high:.3g} s; the median is {middle:.3g} s"
        )


def _jitter(record: Record, _: str) -> Iterable[str]:
    clock = clock_of_record(record)
    if clock.jitter > EVEN and not clock.uneven and not clock.falls and not clock.repeats:
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
            yield f"the text {text.value!r} at {place}, {_counted(text.count, 'text')} in all"


def _empty(record: Record, column: str) -> list[Finding]:
    """Find values that are missing; a few in a row can be filled."""
    finite = np.isfinite(record.columns[column])
    if any(text.column == column for text in record.texts):
        return []
    if own_rate(record.time, record.columns[column]) is not None:
        return []
    runs = [(end - begin, begin) for begin, end in runs_of(~finite) if end - begin > record.fill]
    if not runs:
        return []
    longest, first = max(runs, key=lambda run: run[0])
    fault = (
        f"{sum(length for length, _ in runs)} of {len(finite)} values are empty or not finite, in "
        f"{_counted(len(runs), 'range')}; the longest has {_counted(longest, 'sample')} from "
        f"{record.place(first)}"
    )
    severity: Severity = "refused" if _is_mostly_empty(record, column) else "remarked"
    more, keys = _filling([length for length, _ in runs])
    remedy = (
        "the record is cut there, if this is an input; no output counts there. Where more than "
        f"half is empty, leave the column out, or record it anew{more}"
    )
    expected = "numbers throughout"
    return [Finding("empty", severity, record.path, column, fault, expected, remedy, keys)]


SAME_RATE = 0.9
"""Two columns have the same rate if the step of one is more than this part of the other's."""


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
    "if they are in another unit, say it: --read time_unit=ms in slide-fmu init, "
    'time_unit = "ms" in system.parameters of a recipe, or in the header',
)
"""The rule about times of which 10 may be 10 ms; only the first such file is named."""

TIME_RULES = (
    Rule("filled", _filled, "no lost samples", "these count as measured"),
    Rule(
        "uneven clock",
        _uneven,
        "even times",
        "the record is resampled to even times, and cut at gaps: record with an even clock, or "
        "take a longer step: --step SECONDS in slide-fmu init, window.step in a recipe; if only "
        f"the stamps are off, {GIVE_STEP}",
    ),
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
