"""This module reads files of all formats as records."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from slide_fmu.core.file_kinds import RECORD_FORMATS
from slide_fmu.core.search_path import find_file
from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.array_files import read_hdf5, read_mat, read_npy
from slide_fmu.record_files.csv_file import read_csv
from slide_fmu.record_files.parquet_file import read_parquet
from slide_fmu.record_files.record import NoTimesError, Record, RecordError, shortened
from slide_fmu.record_files.table import (
    MOST_NUMBERS,
    SECONDS,
    Choice,
    RecordTable,
    TextForm,
    counts_samples,
    epoch_of,
    is_time,
    rises,
    unit_of_times,
)

READERS: dict[str, Callable[[Path, Choice], RecordTable]] = {
    "CSV": read_csv,
    "Parquet": read_parquet,
    "HDF5": read_hdf5,
    "MAT": read_mat,
    "NumPy": read_npy,
}
"""Readers by format (``RECORD_FORMATS``)."""


def read_record(
    path: str,
    names: Sequence[str] | None = None,
    *,
    others: bool = False,
    time: str | None = None,
    step: float | None = None,
    most: int = MOST_NUMBERS,
) -> Record:
    """Read one record, as ``read_records`` reads several."""
    return read_records([path], names, others=others, time=time, step=step, most=most)[0]


def read_records(
    paths: Sequence[str],
    names: Sequence[str] | None = None,
    *,
    others: bool = False,
    time: str | None = None,
    step: float | None = None,
    most: int = MOST_NUMBERS,
    form: TextForm | None = None,
    time_unit: str = "",
) -> tuple[Record, ...]:
    """Read records of the same columns, which may differ in length, each from a file.

    Args:
        paths: files of the known formats (``RECORD_FORMATS``), from here or from a folder in which
            modules are looked for.
        names: wanted columns, which are not times even if their names suggest it; None for all.
            Other columns are not kept in memory.
        others: whether all other columns are wanted too.
        time: column of times; None where it is to be found by its name and unit. A column that
            falls often does not count as times if there is another one.
        step: sample step in s, where the files have no times, or their times are not to be used.
        most: number of samples times columns that are read at most, of all files together.
        form: how text files are written; guessed where None.
        time_unit: unit of times that have none.

    Raises:
        RecordError: a file is missing, of an unknown format, malformed or too large, lacks a
            column, has no times while no step is given, has other columns or units than the first,
            or holds the same as another one.
    """
    records: list[Record] = []
    wanted = None if names is None else tuple(names)
    for path in paths:
        if step is not None and not (time is None and 0 < step < math.inf):
            raise RecordError(
                f"{path}: step = {step} s with the time column {time!r}; expected a positive, "
                "finite step without a time column, or a time column alone"
            )
        with_step, form = step is not None, form or TextForm()
        choice = Choice(path, wanted, others, time, with_step, most, form, time_unit)
        record = _read(choice, step)
        most = max(0, most - len(record.time) * (1 + len(record.columns)))
        for other in records:
            _require_another(other, record)
        if records:
            _require_alike(records[0], record)
        records.append(record)
    if not records:
        raise RecordError("no file is named; expected at least one")
    return tuple(records)


def _read(choice: Choice, step: float | None) -> Record:
    """Read one record with the reader of its format."""
    path = choice.path
    try:
        file_path = find_file(path)
    except OSError as error:
        raise RecordError(str(error)) from error
    format_name = RECORD_FORMATS.get(file_path.suffix.lower())
    if format_name is None:
        raise RecordError(
            f"{path} ends with {file_path.suffix!r}; expected one of "
            f"{list(RECORD_FORMATS)}: convert it"
        )
    try:
        with file_path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        table = READERS[format_name](file_path, choice)
    except OSError as error:
        raise RecordError(f"{path}: {error}; expected a file that can be read") from error
    return _with_time(table, choice, step, digest)


def _with_time(table: RecordTable, choice: Choice, step: float | None, digest: str) -> Record:
    """Separate the times, in s, from the other columns."""
    clocks = _clocks(table, choice)
    columns = {name: table.columns[name] for name in _signals(table, choice, clocks)}
    if step is not None:
        length = len(next(iter(table.columns.values()), ()))
        clock, clocks = None, {}
        times = step * np.arange(length, dtype=np.float64)
    else:
        clock = choice.time or next(iter(clocks))
        times = clocks.pop(clock)
    texts = tuple(text for text in table.texts if text.column in (*columns, clock))
    _require_samples(times, clock, columns, choice.path)
    return Record(
        times,
        columns,
        {name: table.units[name] for name in columns},
        choice.path,
        digest,
        clock,
        clocks,
        clock_is_chosen=choice.time is not None,
        texts=texts,
        first_line=table.first_line,
        clock_unit="s" if clock is None else _clock_unit(table, clock, choice),
    )


def _clocks(table: RecordTable, choice: Choice) -> dict[str, FloatArray]:
    """Return the columns of times, in s, by name; at least one unless the step is given."""
    clocks: dict[str, FloatArray] = {}
    for name, values in table.columns.items():
        if name not in (choice.time, *table.clocks) and counts_samples(name, values):
            continue
        by_name = is_time(name, table.units[name]) and name not in (choice.names or ())
        if name == choice.time or name in table.clocks or by_name:
            unit = _clock_unit(table, name, choice)
            since = values - values[0] if epoch_of(values) and len(values) else values
            clocks[name] = since * SECONDS[unit]
    rising = {name: times for name, times in clocks.items() if name == choice.time or rises(times)}
    if rising or choice.step:
        return rising
    if not clocks:
        raise NoTimesError(
            f"{choice.path} has no column of times among {shortened(table.columns)}; expected one "
            "named time, t or the like, or with dates or times of day: name it with time, or give "
            "the step"
        )
    return clocks


def _signals(table: RecordTable, choice: Choice, clocks: dict[str, FloatArray]) -> list[str]:
    """Return the wanted columns that are not times."""
    others = {
        name
        for name, values in table.columns.items()
        if choice.all and name not in clocks and not counts_samples(name, values)
    }
    return [name for name in table.columns if name in others or name in (choice.names or ())]


def _clock_unit(table: RecordTable, name: str, choice: Choice) -> str:
    """Return the unit of a column of times: its own, the given one, that of times since 1970.

    It is empty where nothing tells it.

    Raises:
        RecordError: the unit is none of time.
    """
    unit = table.units[name]
    if unit.lower() not in SECONDS:
        raise RecordError(
            f"{choice.path}: time {name!r} has the unit {unit!r}; expected one of "
            f"{[known for known in SECONDS if known]}: name another column"
        )
    known = unit_of_times(name, unit) or choice.time_unit
    return known or epoch_of(table.columns[name])


def _require_samples(
    times: FloatArray, clock: str | None, columns: dict[str, FloatArray], path: str
) -> None:
    """Refuse a record of fewer than two samples, or without any column other than the time."""
    if len(times) < 2 or not columns:
        raise RecordError(
            f"{path} has {len(times)} samples of {list(columns)}, time {clock!r}; expected at "
            "least two samples of at least one column other than the time"
        )


def _require_another(one: Record, other: Record) -> None:
    """Refuse the same record twice: the test would use samples that were learnt from."""
    if other.digest == one.digest:
        raise RecordError(
            f"{other.path} holds the same bytes as {one.path}; expected each record once: leave "
            "one of them out"
        )


def _require_alike(first: Record, other: Record) -> None:
    """Refuse a record with other columns or units than the first."""
    if other.units != first.units:
        differ = set(first.units.items()) ^ set(other.units.items())
        raise RecordError(
            f"{other.path} and {first.path} differ in the columns {sorted(differ)}; expected the "
            "same names and units in all records: name the columns that both have as inputs and "
            "outputs, or correct the headers"
        )
