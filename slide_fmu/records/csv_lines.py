"""Lines of a text file that have more or fewer values than there are names."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from slide_fmu.records.csv_format import BLANKS, CsvFormat
from slide_fmu.records.record import RecordError


def require_no_surplus(chunk: Any, samples: int, form: CsvFormat, path: str) -> None:
    """Refuse lines of more values than names; a last separator does not count.

    Args:
        chunk: some lines, a table of pandas, behind so many samples.

    Raises:
        RecordError: with the first line of that kind.
    """
    width = len(form.units)
    wrong = np.flatnonzero(chunk.iloc[:, width:].notna().any(axis=1).to_numpy())
    if chunk.shape[1] < width or len(wrong):
        line = form.first_line + samples + (int(wrong[0]) if len(wrong) else 0)
        raise _wrong_width(path, line, chunk.shape[1], width)


class ShortLines:
    """ShortLines finds lines of fewer values than names, except empty ones. Final.

    pandas does not tell values that are not there from empty ones, so that lines which seem to
    end with an empty value are looked at once more.
    """

    def __init__(self, form: CsvFormat) -> None:
        self._form = form
        self._suspects: list[NDArray[np.intp]] = []

    def look_at(self, chunk: Any, samples: int) -> None:
        """Remember the lines of a chunk, behind so many samples, that may be short."""
        width = len(self._form.units)
        filled = chunk.iloc[:, : width - 1].notna().any(axis=1)
        suspects = np.flatnonzero(filled & chunk.iloc[:, width - 1].isna())
        self._suspects.append(samples + suspects)

    def require_none(self, path: Path, name: str) -> None:
        """Refuse the file if one of the remembered lines is short.

        Raises:
            RecordError: with the first line of that kind.
        """
        form, width = self._form, len(self._form.units)
        suspects = set(np.concatenate(self._suspects).tolist()) if self._suspects else set()
        if not suspects:
            return
        with path.open(encoding=form.encoding, errors="replace", newline="") as file:
            for sample, values in enumerate(_values(file, form)):
                if sample in suspects and len(values) < width:
                    raise _wrong_width(name, form.first_line + sample, len(values), width)


def _values(file: TextIO, form: CsvFormat) -> Iterator[list[str]]:
    """Split the lines of samples into their values."""
    lines = islice(file, form.first_line - 1, None)
    if form.separator == BLANKS:
        return (line.split() for line in lines)
    return csv.reader(lines, delimiter=form.separator)


def _wrong_width(path: str, line: int, found: int, width: int) -> RecordError:
    return RecordError(
        f"{path}, line {line} has {found} values; expected {width} values in each line, as many "
        "as there are names: correct the file"
    )
