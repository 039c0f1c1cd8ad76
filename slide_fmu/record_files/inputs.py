"""A file of inputs over time is read for the inputs of a system; its clock may be any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, on_circles
from slide_fmu.core.units import are_other, behind
from slide_fmu.record_files.reading import read_record
from slide_fmu.record_files.record import MissingColumnsError, Record, RecordError

TIME = "time"
"""The name of the column of times where a mapping of names to columns says which one it is."""

EVEN, MOST_UNEVEN = 0.01, 0.1
"""A clock is even where at most the part MOST_UNEVEN of its distances differ from their median by
more than the part EVEN of it."""

GAP = 10.0
"""Samples with an even clock lack some where two are this many usual distances apart. Fewer are
bridged by a straight line, and an uneven clock has no usual distance."""

SLACK = 1e-6
"""A time that differs by this part of the least distance from that of a sample is its time."""


@final
@dataclass(frozen=True, eq=False)
class InputTable:
    """An InputTable has inputs over time.

    Attributes:
        record: the file as it was read.
        signals: the inputs, in channel order.
        times: times in s from the first sample of the file on, which rise, shape (N,), N >= 2.
        values: the inputs at these times in their units, shape (N, n_inputs).
    """

    record: Record = field(repr=False)
    signals: tuple[Signal, ...]
    times: FloatArray
    values: FloatArray

    @property
    def duration(self) -> float:
        """Time in s from the first sample to the last."""
        return float(self.times[-1])

    def at(self, times: FloatArray) -> FloatArray:
        """Return the inputs at times in s from the first sample on, (M,), shape (M, n_inputs).

        Between samples they move along straight lines, or are held, as their signals say; an angle
        turns. Before the first sample and after the last one they are constant.
        """
        slack = SLACK * float(np.diff(self.times).min())
        place = np.searchsorted(self.times, times + slack, side="right") - 1
        held = self.values[np.maximum(place, 0)]
        columns = [
            held[:, index]
            if signal.hold == "zero_order"
            else np.interp(times, self.times, self.values[:, index])
            for index, signal in enumerate(self.signals)
        ]
        return on_circles(self.signals, np.stack(columns, axis=1))

    def require_in_range(self) -> None:
        """Refuse values beyond the range of an input.

        Raises:
            RecordError: the message has the input, the farthest value, its place and the remedy.
        """
        for signal, values in zip(self.signals, self.values.T, strict=True):
            beyond = np.maximum(signal.low - values, values - signal.high)
            worst = int(np.argmax(beyond))
            if signal.angle is None and beyond[worst] > 0:
                unit = behind(signal.unit)
                raise RecordError(
                    f"{self.record.path}, {self.record.place(worst)}: {signal.name!r} = "
                    f"{values[worst]:.6g}{unit}, and {np.count_nonzero(beyond > 0)} of "
                    f"{len(values)} values are beyond its range; expected {signal.low:g} .. "
                    f"{signal.high:g}{unit}, a limit of the model: correct the file or its unit, "
                    "or widen the range if the model holds there"
                )


def read_inputs(
    path: str, signals: Sequence[Signal], columns: Mapping[str, str] | None = None
) -> InputTable:
    """Read the inputs of a system from a file (CSV, Parquet, HDF5, MAT or NumPy).

    Args:
        path: the file, from here or from a folder in which modules are looked for.
        signals: the inputs in channel order.
        columns: names of columns by input, where they differ from its name; ``time`` is the column
            of times, which is otherwise found by its name and unit.

    Raises:
        RecordError: the file cannot be read, lacks a column, has another unit than an input, has
            values that are no finite numbers, or times that do not rise or leave a gap.
    """
    named = dict(columns or {})
    wanted = [named.get(signal.name, signal.name) for signal in signals]
    record = _read(path, wanted, named.get(TIME))
    for signal, name in zip(signals, wanted, strict=True):
        if are_other(record.units[name], signal.unit):
            raise RecordError(
                f"{path}: column {name!r} is in {record.units[name]}; expected {signal.unit}, the "
                f"unit of {signal.name!r}: convert the column and its header"
            )
    values = record.chosen(tuple(wanted))
    _require_numbers(record, wanted, values)
    _require_times(record)
    return InputTable(record, tuple(signals), record.time - record.time[0], values)


def duration_of(path: str, columns: Mapping[str, str]) -> float:
    """Return the time in s from the first to the last sample of a file of inputs.

    Raises:
        RecordError: as in ``read_inputs``.
    """
    record = read_record(path, time=columns.get(TIME))
    _require_times(record)
    return float(record.time[-1] - record.time[0])


def _read(path: str, wanted: Sequence[str], time: str | None) -> Record:
    try:
        return read_record(path, tuple(dict.fromkeys(wanted)), time=time)
    except MissingColumnsError as error:
        raise RecordError(
            f"{error}. A file of inputs has a column for each of {list(wanted)}, and one of times"
        ) from error


def _require_numbers(record: Record, names: Sequence[str], values: FloatArray) -> None:
    """Refuse empty cells, texts and values that are not finite."""
    for name, column in zip(names, values.T, strict=True):
        wrong = np.flatnonzero(~np.isfinite(column))
        if len(wrong):
            raise RecordError(
                f"{record.path}, {record.place(int(wrong[0]))}: {name!r} is no finite number, as "
                f"{len(wrong)} of {len(column)} values are; expected one in each row: fill the "
                "gap, or cut the file before it"
            )


def _require_times(record: Record) -> None:
    """Refuse times that are not finite, do not rise, or leave a gap in an even clock."""
    wrong = np.flatnonzero(~np.isfinite(record.time))
    if len(wrong):
        raise RecordError(
            f"{record.path}, sample {wrong[0] + 1}: the time is no finite number; expected times "
            "that rise: mend the column of times"
        )
    steps = np.diff(record.time)
    falls = np.flatnonzero(steps <= 0)
    if len(falls):
        before = record.time[falls[0]]
        raise RecordError(
            f"{record.path}, {record.place(int(falls[0]) + 1)}: the time does not rise, after "
            f"{before:.6g} s; expected times that rise: mend the column of times"
        )
    usual = float(np.median(steps))
    even = np.mean(np.abs(steps - usual) > EVEN * usual) <= MOST_UNEVEN
    widest = int(np.argmax(steps))
    if even and steps[widest] > GAP * usual:
        raise RecordError(
            f"{record.path}, {record.place(widest)}: the next sample comes {steps[widest]:.6g} s "
            f"later, and samples are {usual:.6g} s apart otherwise; expected no gap: fill it, or "
            "cut the file there"
        )
