"""This module reads records of files that hold arrays: HDF5, MAT of any version, NPY and NPZ.

MAT files from version 7.3 on are HDF5 files.
"""

from __future__ import annotations

import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.modelica_file import is_result, read_result
from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.record_files.table import Choice, RecordTable, is_time, library

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
        RecordError: there are no columns, the wanted columns differ in length, or all columns of
            times do from them, or there are too many samples.
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
    clocks = [name for name in kept if is_time(name, by_column[name].unit)]
    kept = [name for name in kept if by_column[name].length == length]
    if clocks and not choice.step and not set(clocks) & set(kept):
        raise RecordError(
            f"{choice.path} has {by_column[clocks[0]].length} times {clocks[0]!r} for {length} "
            "samples; expected as many: write them anew, or give the step; with slide-fmu init: "
            "--time none --step SECONDS"
        )
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


def read_hdf5(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of an HDF5 file: datasets in any group, by their names in the file.

    A dataset ``group/road`` is the column of that name. Units stand in the attribute ``unit`` or
    ``units``. MAT files from version 7.3 on are read so too.

    Raises:
        RecordError: the file is no HDF5 file, lacks a column, or has too many samples.
    """
    h5py = library("h5py", choice.path)
    columns: dict[str, Column] = {}

    def visit(name: str, item: Any) -> None:
        numeric = isinstance(item, h5py.Dataset) and item.dtype.kind in NUMBERS
        hidden = name.startswith("#") or item.attrs.get("MATLAB_class") == b"char"
        if numeric and not hidden and item.shape:
            columns.update(columns_of(name, item.shape, _unit(item), lambda part: item[part]))

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
            return table_of(columns, choice)
    except OSError as error:
        raise RecordError(
            f"{choice.path}: {error}; expected an HDF5 file that is whole: write it again"
        ) from error


def _unit(item: Any) -> str:
    """Return the unit in the attributes of a dataset; empty without one."""
    unit = item.attrs.get("unit", item.attrs.get("units", ""))
    if isinstance(unit, np.ndarray):  # as MATLAB and others write texts
        unit = unit.flat[0] if unit.size == 1 else ""
    return unit.decode(errors="replace") if isinstance(unit, bytes) else str(unit)


NUMERIC = (
    *("double", "single", "logical", "int8", "int16", "int32", "int64"),
    *("uint8", "uint16", "uint32", "uint64"),
)
"""Classes of arrays that hold numbers."""

BROKEN = (NotImplementedError, TypeError, ValueError, OSError, zlib.error)
"""Exceptions of scipy for a file that is not a whole MAT file, beside its own ``MatReadError``."""

HDF5 = b"\x89HDF\r\n\x1a\n"
"""First bytes of HDF5, behind the 512 bytes of MATLAB's own."""


def read_mat(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of a MAT file: variables, and the fields of structures.

    Result files of Modelica tools are read as such. The field ``road`` of a structure ``data`` is
    the column ``data.road``, and fields of nested structures are columns too. The whole file is
    read into memory.

    Raises:
        RecordError: the file is no MAT file, lacks a column, or has too many samples.
    """
    from scipy.io import loadmat, whosmat  # recipes of FMUs are read without it
    from scipy.io.matlab import MatReadError

    with path.open("rb") as file:
        begin = file.read(512 + len(HDF5))
    if HDF5 in (begin[512:], begin[: len(HDF5)]):
        return read_hdf5(path, choice)
    try:
        shapes = [shape for _, shape, kind in whosmat(str(path)) if kind in NUMERIC]
        longest = max((max(shape, default=0) for shape in shapes), default=0)
        numbers = sum(int(np.prod(shape)) for shape in shapes)
        if is_result([name for name, _, _ in whosmat(str(path))]):
            return read_result(loadmat(str(path), chars_as_strings=False), choice)
        choice.require_room(longest, numbers // max(1, longest))
        return table_of(_columns(loadmat(str(path))), choice)
    except RecordError:
        raise
    except (MatReadError, *BROKEN) as error:
        raise RecordError(
            f"{choice.path}: {error}; expected a MAT file that is whole: write it again"
        ) from error


def read_npy(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of an NPY or NPZ file.

    Fields of a structured array have their names, arrays of an NPZ file too. The columns of an
    array without names are ``column_1``, ``column_2``, ...

    Raises:
        RecordError: the file is none of numpy, has objects, lacks a column, or has too many
            samples.
    """
    try:
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            arrays = {"column": loaded} if isinstance(loaded, np.ndarray) else dict(loaded)
        fields = arrays["column"].dtype.names if isinstance(loaded, np.ndarray) else None
        if fields:
            arrays = {field: loaded[field] for field in fields}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        pickled = "pickle" in str(error) or "Object" in str(error)  # whose advice is unsafe
        reason = "it has objects, or is none of numpy's files" if pickled else str(error)
        raise RecordError(
            f"{choice.path}: {reason}; expected a file of numpy that is whole, with numbers: "
            "write it again"
        ) from error
    return table_of(_columns(arrays), choice)


def _columns(variables: Mapping[str, Any], structure: str = "") -> dict[str, Column]:
    """Return the columns in variables, or in the fields of a structure and of nested ones."""
    columns: dict[str, Column] = {}
    for name, values in variables.items():
        if isinstance(values, np.ndarray) and values.dtype.kind in NUMBERS:
            columns.update(columns_of(structure + name, values.shape, "", values.__getitem__))
        elif isinstance(values, np.ndarray) and values.dtype.names and values.size == 1:
            element = values.reshape(-1)[0]
            fields = {field: np.asarray(element[field]) for field in values.dtype.names}
            columns.update(_columns(fields, f"{structure}{name}."))
    return columns
