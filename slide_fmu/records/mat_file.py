"""Records in MAT files of the versions before 7.3."""

from __future__ import annotations

import zlib
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatReadError

from slide_fmu.records.arrays import NUMBERS, Column, Rows, columns_of, table_of
from slide_fmu.records.hdf5_file import read_hdf5
from slide_fmu.records.record import RecordError
from slide_fmu.records.table import Choice, Table

NUMERIC = (
    *("double", "single", "logical", "int8", "int16", "int32", "int64"),
    *("uint8", "uint16", "uint32", "uint64"),
)
"""Classes of arrays that hold numbers."""

BROKEN = (MatReadError, NotImplementedError, TypeError, ValueError, OSError, zlib.error)
"""What scipy raises at a file that is no MAT file, or not all of one."""

HDF5 = b"\x89HDF\r\n\x1a\n"
"""What HDF5 begins with, behind the 512 bytes that are MATLAB's own."""


def read_mat(path: Path, choice: Choice) -> Table:
    """Read the wanted columns of a MAT file: variables, and the fields of structures.

    The field ``road`` of a structure ``data`` is the column ``data.road``, and so are fields of
    structures in it.

    Raises:
        RecordError: the file is no MAT file, lacks a column, or has too many samples.
    """
    with path.open("rb") as file:
        begin = file.read(512 + len(HDF5))
    if HDF5 in (begin[512:], begin[: len(HDF5)]):
        return read_hdf5(path, choice)
    found: dict[str, Column] = {}
    try:
        for name, shape, kind in whosmat(str(path)):
            if kind in NUMERIC:
                read = partial(_part, path, choice, name, shape)
                found.update(columns_of(name, shape, "", read))
            elif kind == "struct" and np.prod(shape) == 1:
                found.update(_fields(path, name, choice))
        return table_of(found, choice)
    except RecordError:
        raise
    except BROKEN as error:
        raise RecordError(
            f"{choice.path}: {error}; expected a MAT file that is whole: write it again"
        ) from error


def _part(
    path: Path, choice: Choice, name: str, shape: tuple[int, ...], part: tuple[Rows, ...]
) -> Any:
    """Read a part of a variable, which comes into memory as a whole."""
    choice.require_room(max(shape), min(shape))
    return _load(path, name)[part]


def _load(path: Path, name: str) -> Any:
    return loadmat(str(path), variable_names=[name])[name]


def _fields(path: Path, name: str, choice: Choice) -> dict[str, Column]:
    """Give the columns in the fields of a structure, which can be read only as a whole."""
    choice.require_room(path.stat().st_size // 8, 1)
    return _of_structure(name, _load(path, name))


def _of_structure(name: str, structure: Any) -> dict[str, Column]:
    """Give the columns in the fields of a structure of one element, and in structures there."""
    found: dict[str, Column] = {}
    fields = structure.reshape(-1)[0]
    for field in fields.dtype.names or ():
        values, inner = np.asarray(fields[field]), f"{name}.{field}"
        if values.dtype.kind in NUMBERS:
            found.update(columns_of(inner, values.shape, "", values.__getitem__))
        elif values.dtype.names and values.size == 1:
            found.update(_of_structure(inner, values))
    return found
