"""This module reads records of Parquet files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.record_files.table import (
    Choice,
    RecordTable,
    library,
    named,
    numbers_or_dates,
    seconds,
    text_among,
)


def read_parquet(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of a Parquet file, one after the other.

    Units stand behind the names, or as ``unit`` in the metadata of the column. Dates become
    seconds since the first of them.

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
                name: _unit(arrow, schema.field(written[name]), unit)
                for name, unit in named_units.items()
            }
            kept = choice.kept(units)
            choice.require_room(file.metadata.num_rows, len(kept))
            columns: dict[str, FloatArray] = {}
            texts: list[Text] = []
            for name in kept:
                series = file.read(columns=[written[name]]).column(0).to_pandas()
                values = numbers_or_dates(series)
                columns[name], text = seconds(values), text_among(name, series, values)
                texts.extend([text] if text else [])
    except (arrow.ArrowException, OSError) as error:
        raise RecordError(
            f"{choice.path}: {error}; expected a Parquet file that is whole: write it again"
        ) from error
    return RecordTable(columns, {name: units[name] for name in kept}, tuple(texts))


def _unit(arrow: Any, column: Any, named_unit: str) -> str:
    """Return the unit of dates, of the name or of the metadata; empty without one."""
    if arrow.types.is_timestamp(column.type):
        return "s"
    known = column.metadata or {}
    unit = known.get(b"unit") or known.get(b"units") or b""
    return named_unit or unit.decode(errors="replace")
