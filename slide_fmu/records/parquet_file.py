"""Records in Parquet files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.record import RecordError, Text
from slide_fmu.records.table import Choice, Table, library, named


def read_parquet(path: Path, choice: Choice) -> Table:
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
                column = file.read(columns=[written[name]]).column(0)
                columns[name], text = _numbers(arrow, column, name)
                texts.extend([text] if text else [])
    except (arrow.ArrowException, OSError) as error:
        raise RecordError(
            f"{choice.path}: {error}; expected a Parquet file that is whole: write it again"
        ) from error
    return Table(columns, {name: units[name] for name in kept}, tuple(texts))


def _unit(arrow: Any, column: Any, named_unit: str) -> str:
    """Give the unit of dates, or that of the name, or in the metadata; empty if there is none."""
    if arrow.types.is_timestamp(column.type):
        return "s"
    told = column.metadata or {}
    return named_unit or (told.get(b"unit") or told.get(b"units") or b"").decode(errors="replace")


def _numbers(arrow: Any, column: Any, name: str) -> tuple[FloatArray, Text | None]:
    """Give the values of a column as numbers, NaN for what is none; tell the texts."""
    kind = column.type
    if arrow.types.is_timestamp(kind):
        stamps = column.to_numpy().astype("datetime64[ns]")
        since = (stamps - stamps[:1]).astype(np.float64)
        return np.where(np.isnat(stamps), np.nan, since * 1e-9), None
    if arrow.types.is_boolean(kind):
        column = column.cast(arrow.int8())
    if (
        arrow.types.is_boolean(kind)
        or arrow.types.is_integer(kind)
        or arrow.types.is_floating(kind)
    ):
        return column.cast(arrow.float64()).to_numpy().copy(), None
    values = np.full(len(column), np.nan)
    first: Text | None = None
    count = 0
    for sample, scalar in enumerate(column):
        if scalar.is_valid:
            try:
                values[sample] = float(scalar.as_py())
            except (TypeError, ValueError):
                count += 1
                first = first or Text(name, 1, sample, str(scalar.as_py())[:40])
    return values, Text(name, count, first.sample, first.value) if first else None
