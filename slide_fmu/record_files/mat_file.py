"""This module reads records of MAT files of versions before 7.3."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatReadError

from slide_fmu.record_files.arrays import NUMBERS, Column, columns_of, table_of
from slide_fmu.record_files.hdf5_file import read_hdf5
from slide_fmu.record_files.record import RecordError
from slide_fmu.record_files.table import Choice, RecordTable

NUMERIC = (
    *("double", "single", "logical", "int8", "int16", "int32", "int64"),
    *("uint8", "uint16", "uint32", "uint64"),
)
"""Classes of arrays that hold numbers."""

BROKEN = (MatReadError, NotImplementedError, TypeError, ValueError, OSError, zlib.error)
"""Exceptions of scipy for a file that is not a whole MAT file."""

HDF5 = b"\x89HDF\r\n\x1a\n"
"""First bytes of HDF5, behind the 512 bytes of MATLAB's own."""


def read_mat(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of a MAT file: variables, and the fields of structures.

    The field ``road`` of a structure ``data`` is the column ``data.road``, and fields of
    nested structures are columns too. The whole file is read into memory.

    Raises:
        RecordError: the file is no MAT file, lacks a column, or has too many samples.
    """
    with path.open("rb") as file:
        begin = file.read(512 + len(HDF5))
    if HDF5 in (begin[512:], begin[: len(HDF5)]):
        return read_hdf5(path, choice)
    try:
        shapes = [shape for _, shape, kind in whosmat(str(path)) if kind in NUMERIC]
        longest = max((max(shape, default=0) for shape in shapes), default=0)
        numbers = sum(int(np.prod(shape)) for shape in shapes)
        choice.require_room(longest, numbers // max(1, longest))
        return table_of(_columns(loadmat(str(path))), choice)
    except RecordError:
        raise
    except BROKEN as error:
        raise RecordError(
            f"{choice.path}: {error}; expected a MAT file that is whole: write it again"
        ) from error


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
