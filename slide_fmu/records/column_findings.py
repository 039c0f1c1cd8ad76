"""What is found in one column of a record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.finding import Finding
from slide_fmu.records.levels import quantization, saturations
from slide_fmu.records.record import Record
from slide_fmu.records.outliers import outliers

EMPTY = 0.5
"""A column of which more than this part is empty is refused."""

COARSE = 1e-3
"""Rounding of more than this part of a column's standard deviation is remarked."""


def column_findings(record: Record, name: str) -> list[Finding]:
    """Find texts, empty stretches, saturation, outliers and coarse rounding in a column."""
    values = record.columns[name]
    finite = np.isfinite(values)
    where = np.flatnonzero(finite)
    found = _texts(record, name)
    if not found:
        found = _empty(record, name, finite)
    if len(where) < 2:
        return found
    known = values[where]
    return [
        *found,
        *_saturation(record, name, known, where),
        *_outliers(record, name, known, where),
        *_quantization(record, name, known),
    ]


def _texts(record: Record, name: str) -> list[Finding]:
    return [
        Finding(
            "text",
            "refused",
            record.path,
            name,
            f"the text {text.value!r} at {record.place(text.sample)}, {text.count} texts in all",
            "numbers throughout",
            "mend the file, or leave the value empty: the record is cut there",
        )
        for text in record.texts
        if text.column == name
    ]


def _empty(record: Record, name: str, finite: NDArray[np.bool_]) -> list[Finding]:
    """Remark stretches without values; refuse a column that is mostly empty."""
    missing = int(np.count_nonzero(~finite))
    if not missing:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~finite, [False]])))
    lengths = edges[1::2] - edges[::2]
    longest = int(lengths.argmax())
    refused = missing > EMPTY * len(finite)
    return [
        Finding(
            "empty",
            "refused" if refused else "remarked",
            record.path,
            name,
            f"{missing} of {len(finite)} values are empty or not finite, in {len(lengths)} "
            f"stretches; the longest has {lengths[longest]} samples from "
            f"{record.place(int(edges[::2][longest]))}",
            "numbers throughout",
            "leave the column out, or record it anew"
            if refused
            else "the record is cut there, if this is an input; no output counts there",
        )
    ]


def _saturation(
    record: Record, name: str, known: FloatArray, where: NDArray[np.intp]
) -> list[Finding]:
    return [
        Finding(
            "saturation",
            "remarked",
            record.path,
            name,
            f"{limit.samples} samples in {limit.runs} runs are exactly "
            f"{record.with_unit(name, limit.value)}, the first at "
            f"{record.place(int(where[limit.first]))}",
            "a signal that turns before it reaches its extreme value",
            "use a wider range of the sensor; if the system itself stops there, all is well",
        )
        for limit in saturations(known)
    ]


def _outliers(
    record: Record, name: str, known: FloatArray, where: NDArray[np.intp]
) -> list[Finding]:
    found = outliers(known)
    if not len(found):
        return []
    first = int(found[0])
    return [
        Finding(
            "outlier",
            "remarked",
            record.path,
            name,
            f"{len(found)} samples jump away from both neighbours, the first from "
            f"{known[first - 1]:.6g} to {record.with_unit(name, known[first])} at "
            f"{record.place(int(where[first]))}",
            "differences like those around it",
            "they are left out of the linear fit that the window follows from, but learnt from: "
            "leave these values empty if they are faults of the measurement",
        )
    ]


def _quantization(record: Record, name: str, known: FloatArray) -> list[Finding]:
    found = quantization(known)
    if found is None or found.noise <= COARSE:
        return []
    return [
        Finding(
            "quantization",
            "remarked",
            record.path,
            name,
            f"{found.levels} different values, in steps of "
            f"{record.with_unit(name, found.resolution)}; the rounding is "
            f"{100 * found.noise:.2g} % of the standard deviation",
            f"at most {100 * COARSE:g} %",
            "no model can be told to be better than this; record or write more digits",
        )
    ]
