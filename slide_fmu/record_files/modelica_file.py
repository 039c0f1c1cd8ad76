"""This module reads result files of Modelica tools: MAT files with trajectories.

Dymola and OpenModelica write the same form: names and descriptions as matrices of characters, two
tables of numbers, and a matrix ``dataInfo`` that says in which table and column each variable is.
The first table has what is constant.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import RecordError
from slide_fmu.record_files.table import Choice, RecordTable

INFO, NAMES, TABLE = "dataInfo", "name", "data_2"
"""Variables of such a file: where each column is, its name, and what moves."""

CONSTANT = 1
"""The table of constants; the time stands in table 0, which is that of what moves."""

UNIT = re.compile(r".*\[([^\]|:]*)[^\]]*\]\s*")
"""A description that ends with a unit, as in ``Length [m]`` or ``Angle [rad|deg]``."""


def is_result(names: Mapping[str, Any] | list[str]) -> bool:
    """Tell whether the variables of a MAT file are those of a result file."""
    return {INFO, NAMES, TABLE} <= set(names)


def read_result(variables: Mapping[str, Any], choice: Choice) -> RecordTable:
    """Read the wanted variables of a result file, whose characters are single.

    At an event the same time stands twice, before and behind it: the sample behind is kept.

    Raises:
        RecordError: a wanted variable is missing or constant, or there are too many samples.
    """
    is_transposed = any("binTrans" in one for one in _texts(variables["Aclass"], False))
    names = _texts(variables[NAMES], is_transposed)
    descriptions = _texts(variables.get("description", np.empty((0, 0))), is_transposed)
    info, table = (
        np.asarray(variables[key]).T if is_transposed else np.asarray(variables[key])
        for key in (INFO, TABLE)
    )
    moving = {
        name: (abs(int(row[1])) - 1, 1.0 if row[1] > 0 else -1.0)
        for name, row in zip(names, info, strict=True)
        if row[0] != CONSTANT
    }
    constant = [one for one in choice.names or () if one in names and one not in moving]
    if constant:
        raise RecordError(
            f"{choice.path}: {constant} are constants of the simulation; expected variables that "
            "move: leave them out"
        )
    by_name = dict(zip(names, descriptions, strict=False))
    units = {name: _unit(by_name.get(name, "")) for name in moving}
    kept = choice.kept(units)
    choice.require_room(len(table), len(kept))
    time = np.asarray(table[:, 0], dtype=np.float64)
    last = np.append(np.diff(time) != 0, True)
    columns: dict[str, FloatArray] = {}
    for name in kept:
        index, sign = moving[name]
        columns[name] = sign * np.asarray(table[last, index], dtype=np.float64)
    return RecordTable(columns, {name: units[name] for name in kept})


def _unit(description: str) -> str:
    match = UNIT.fullmatch(description)
    return match[1].strip() if match else ""


def _texts(characters: NDArray[Any], is_transposed: bool) -> list[str]:
    """Return the rows, or columns, of a matrix of characters as texts."""
    rows = characters.T if is_transposed else characters
    return ["".join(map(str, np.atleast_1d(row))).replace("\x00", "").strip() for row in rows]
