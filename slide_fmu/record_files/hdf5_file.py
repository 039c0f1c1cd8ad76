"""This module reads records of HDF5 files, and of MAT files from version 7.3 on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.record_files.arrays import NUMBERS, Column, columns_of, table_of
from slide_fmu.record_files.record import RecordError
from slide_fmu.record_files.table import Choice, RecordTable, library


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
