"""This module reads records of Parquet files."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.dates import Kind, joined, kind_of, seconds_of, since_first
from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.record_files.table import (
    Choice,
    RecordTable,
    library,
    named,
    numbers,
    text_among,
)

LOOKED_AT = 50
"""Number of texts by which times are found."""


def read_parquet(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of a Parquet file, one after the other.

    Units stand behind the names, or as ``unit`` in the metadata of the column. Dates, times of day
    and lapses of time become times in s, be they values of their types or texts.

    Raises:
        RecordError: the file is no Parquet file, lacks a column, or has too many samples.
    """
    parquet = library("pyarrow.parquet", choice.path)
    arrow = library("pyarrow", choice.path)
    try:
        with parquet.ParquetFile(path) as file:
            schema = file.schema_arrow
            named_units = named(schema.names, choice.path)
            written = dict(zip(named_units, schema.names, strict=True))
            units = {
                name: _unit(schema.field(written[name]), unit)
                for name, unit in named_units.items()
            }
            wanted = set(choice.names or ()) - {choice.time}
            clocks = {
                name: kind
                for name, text in written.items()
                if name not in wanted and (kind := _kind(arrow, file, text)) is not None
            }
            units.update(dict.fromkeys(clocks, "s"))
            kept = choice.kept(units, clocks)
            choice.require_room(file.metadata.num_rows, len(kept))
            columns: dict[str, FloatArray] = {}
            texts: list[Text] = []
            for name in kept:
                series = file.read(columns=[written[name]]).column(0).to_pandas()
                values = _values(series, clocks.get(name))
                columns[name], text = values, text_among(name, series, values)
                texts.extend([text] if text else [])
    except (arrow.ArrowException, OSError) as error:
        raise RecordError(
            f"{choice.path}: {error}; expected a Parquet file that is whole: write it again"
        ) from error
    times = {name: columns.pop(name) for name in kept if name in clocks}
    columns = {**joined(times, {name: clocks[name] for name in times}), **columns}
    known = tuple(name for name in columns if name in times)
    return RecordTable(columns, {n: units[n] for n in columns}, tuple(texts), clocks=known)


def _kind(arrow: Any, file: Any, column: str) -> Kind | None:
    """Return the kind of times in a column, by its type or by its first texts; else None."""
    type_ = file.schema_arrow.field(column).type
    if arrow.types.is_timestamp(type_) or arrow.types.is_date(type_):
        return "stamp"
    if arrow.types.is_time(type_):
        return "clock"
    if arrow.types.is_duration(type_):
        return "lapse"
    if not (arrow.types.is_string(type_) or arrow.types.is_large_string(type_)):
        return None
    batch = next(file.iter_batches(batch_size=LOOKED_AT, columns=[column]), None)
    return None if batch is None else kind_of(map(str, batch.column(0).to_pylist()))


def _values(series: Any, kind: Kind | None) -> FloatArray:
    """Return the numbers of a series of pandas, or its times in s."""
    pandas = importlib.import_module("pandas")
    types = pandas.api.types
    if kind is None:
        return numbers(series)
    if types.is_datetime64_any_dtype(series):
        return since_first(series)
    if types.is_timedelta64_dtype(series):
        return np.asarray(series.dt.total_seconds(), dtype=np.float64)
    if kind == "stamp" and not types.is_string_dtype(series):  # dates of Python
        return since_first(pandas.to_datetime(series))
    return seconds_of(series, kind)


def _unit(column: Any, named_unit: str) -> str:
    """Return the unit of the name or of the metadata; empty without one."""
    known = column.metadata or {}
    unit = known.get(b"unit") or known.get(b"units") or b""
    return named_unit or unit.decode(errors="replace")
