"""Signals over time are CSV files: a column ``time`` in s, then one for each variable."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping

import numpy as np

from slide_fmu.apps.credentials.schema import CredentialError
from slide_fmu.core.signals import FloatArray

TIME = "time"
DIGITS = 9
"""Number of digits of values: single precision has seven."""


def rounded(values: FloatArray) -> FloatArray:
    """Return values rounded as a file stores them, of any shape."""
    flat = [float(f"{value:.{DIGITS}g}") for value in values.ravel()]
    return np.array(flat, dtype=np.float64).reshape(values.shape)


def write_table(time: FloatArray, columns: Mapping[str, FloatArray]) -> bytes:
    """Write columns (N,) by name at times (N,) in s; times have all their digits."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([TIME, *columns])
    for t, *row in zip(time.tolist(), *columns.values(), strict=True):
        writer.writerow([repr(t), *(f"{value:.{DIGITS}g}" for value in row)])
    return stream.getvalue().encode("utf-8")


def read_table(content: bytes, name: str) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Read times (N,) in s, and columns (N,) by name.

    Raises:
        CredentialError: there is no column of time, no other one, or no rows, a row has another
            length, or a value is not a number; the message has the file's name and the line.
    """
    try:
        lines = list(csv.reader(io.StringIO(content.decode("utf-8"))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise CredentialError(f"{name} is no CSV file: {error}; expected UTF-8 text") from error
    if len(lines) < 2 or lines[0][:1] != [TIME] or len(lines[0]) < 2:
        raise CredentialError(
            f"{name} begins with {lines[:1]} and has {len(lines)} lines; expected names of two "
            f"or more columns, {TIME!r} first, and rows of numbers"
        )
    rows = [_numbers(line, name, number + 2) for number, line in enumerate(lines[1:])]
    for number, row in enumerate(rows):
        if len(row) != len(lines[0]):
            raise CredentialError(
                f"{name}, line {number + 2} has {len(row)} values; expected {len(lines[0])}, one "
                "for each column"
            )
    time, *columns = np.array(rows, dtype=np.float64).T
    return time, dict(zip(lines[0][1:], columns, strict=True))


def _numbers(line: list[str], name: str, number: int) -> list[float]:
    try:
        return [float(text) for text in line]
    except ValueError as error:
        raise CredentialError(f"{name}, line {number}: {error}; expected numbers") from error
