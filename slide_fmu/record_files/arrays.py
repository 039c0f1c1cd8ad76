"""This module chooses the columns of one record among named arrays of HDF5 and MAT files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.record_files.table import Choice, RecordTable

NUMBERS = "biufc"
"""Codes of numpy for the kinds of arrays that are read; complex ones count as faults."""

MOST_COLUMNS = 1000
"""An array with more columns than this is ignored: it may be a picture."""


@dataclass(frozen=True)
class Column:
    """A Column is one column of a record in an array, before it is read.

    Attributes:
        length: number of samples.
        unit: unit, empty if the file has none.
        values: function that reads the values, shape (length,).
    """

    length: int
    unit: str
    values: Callable[[], NDArray[np.generic]]


Rows = slice | int
"""An index of one axis of an array."""


def columns_of(
    name: str,
    shape: tuple[int, ...],
    unit: str,
    read: Callable[[tuple[Rows, ...]], NDArray[np.generic]],
) -> dict[str, Column]:
    """Return the columns of one array: itself, or ``name_1``, ``name_2``, ... of two axes.

    The longer axis is the time. Single numbers and arrays of more axes are no columns.

    Args:
        read: reads a part of the array, so that other columns need no memory.
    """
    long = [length for length in shape if length != 1]
    if len(long) == 1:
        whole = (slice(None),) * len(shape)
        return {name: Column(long[0], unit, lambda: np.reshape(read(whole), -1))}
    if len(shape) != 2 or not 0 < min(shape) <= MOST_COLUMNS:
        return {}

    def column(index: int) -> Column:
        part = (index, slice(None)) if shape[0] < shape[1] else (slice(None), index)
        return Column(max(shape), unit, lambda: read(part))

    return {f"{name}_{index + 1}": column(index) for index in range(min(shape))}


def table_of(by_column: dict[str, Column], choice: Choice) -> RecordTable:
    """Read the wanted columns; without names, all columns of the most frequent length.

    Where all others are wanted too, only others of the same length are read. Columns of times are
    left out if their length differs from the wanted columns.

    Raises:
        RecordError: there are no columns, the wanted columns differ in length, or there are too
            many samples.
    """
    if not by_column:
        raise RecordError(
            f"{choice.path} has no arrays of numbers; expected one for each signal, or one with "
            "a column for each"
        )
    kept = choice.kept({name: column.unit for name, column in by_column.items()})
    wanted = [n for n in kept if not choice.names or n in (*choice.names, choice.time)]
    lengths = Counter(by_column[name].length for name in wanted)
    length = lengths.most_common(1)[0][0]
    others = [name for name in wanted if by_column[name].length != length]
    if others and choice.names:
        by_name = {name: by_column[name].length for name in wanted}
        raise RecordError(
            f"{choice.path} has columns of the lengths {by_name}; expected one length for all "
            "that are measured together: read them as several records"
        )
    kept = [name for name in kept if by_column[name].length == length]
    choice.require_room(length, len(kept))
    columns: dict[str, FloatArray] = {}
    texts: list[Text] = []
    for name in kept:
        columns[name], text = _floats(name, by_column[name].values())
        texts.extend([text] if text else [])
    return RecordTable(columns, {name: by_column[name].unit for name in kept}, tuple(texts))


def _floats(name: str, values: NDArray[np.generic]) -> tuple[FloatArray, Text | None]:
    """Return the numbers of a column; complex ones are NaN, and count as texts."""
    if not np.iscomplexobj(values):
        return np.asarray(values, dtype=np.float64), None
    return np.full(values.shape, np.nan), Text(name, values.size, 0, str(values.flat[0])[:40])
