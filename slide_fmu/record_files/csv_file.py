"""This module finds the format of a text file, and reads its record with pandas in chunks."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.record_files.table import (
    DATE,
    INDEX,
    UNIT,
    Choice,
    RecordTable,
    library,
    may_be_time,
    named,
    numbers_or_dates,
    seconds,
    text_among,
)

CHUNK = 1_000_000
"""Number of values that are read at a time."""

HEAD = 1024 * 1024
"""Number of bytes from which the format of the file is found."""

LOOKED_AT = 50
"""Largest number of lines from which separator, names and columns of dates are found."""

BLANKS = r"\s+"
"""Pattern of blanks as a separator, as pandas takes it."""

SEPARATORS = (";", "\t", ",", "|", BLANKS)
"""Separators that are tried, in this order."""

VALUES = {
    sign: re.compile(
        rf"[-+]?(\d+({re.escape(sign)}\d*)?|{re.escape(sign)}\d+)([eE][-+]?\d+)?"
        r"|(nan|na|n/a|null|none|[-+]?inf)?",
        re.IGNORECASE,
    )
    for sign in ".,"
}
"""Pattern of a value by its decimal sign: a number, or a mark of a missing one."""

GROUPED = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""Pattern of a number whose comma may group thousands, or stand before the decimals."""

MISSING = ("na", "none")
"""Words for a missing number, in addition to the ones that pandas knows."""

ROW = 1 / 3
"""More than this part of the fields of a row of samples are numbers or dates."""


@dataclass(frozen=True)
class CsvFormat:
    """A CsvFormat describes the format of a text file.

    Attributes:
        encoding: encoding of the characters.
        separator: separator of values, as pandas takes it.
        decimal: sign before the decimals, ``"."`` or ``","``.
        units: units by the names of the columns, in the order of the file; empty if not given.
        dates: names of the columns in which the first samples have dates.
        first_line: line of the first sample; lines are counted from 1.
    """

    encoding: str
    separator: str
    decimal: str
    units: dict[str, str]
    dates: tuple[str, ...]
    first_line: int


def read_csv(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of a text file, whose lines are samples, in chunks.

    Empty lines at its end are left out; an empty line elsewhere is a sample without values. Times
    may be dates as of ISO 8601, which become seconds since the first of them.

    Raises:
        RecordError: no header, wrong columns, lines with too many or too few values, or too many
            samples.
    """
    form = find_format(path, choice)
    pandas = library("pandas", choice.path)
    kept = choice.kept(form.units)
    dates = [name for name in form.dates if _may_be_dates(name, form, choice)]
    parts: dict[str, list[NDArray[Any]]] = {name: [] for name in kept}
    texts: dict[str, Text] = {}
    try:
        for samples, chunk in _chunks(pandas, path, form, choice):
            choice.require_room(samples + len(chunk), len(kept), at_least=True)
            for name in kept:
                raw = chunk[list(form.units).index(name)]
                values = numbers_or_dates(raw, form.decimal, name in dates)
                parts[name].append(values)
                text = text_among(name, raw, values, samples)
                if text is not None:
                    first = texts.get(name, replace(text, count=0))
                    texts[name] = replace(first, count=first.count + text.count)
    except pandas.errors.EmptyDataError as error:
        raise RecordError(
            f"{choice.path} has nothing from line {form.first_line} on; expected a line for each "
            "sample there: is the file whole?"
        ) from error
    except (pandas.errors.ParserError, UnicodeError) as error:
        raise RecordError(
            f"{choice.path}: {str(error).strip()}; expected {len(form.units)} values in each "
            "line, as many as there are names: correct the file"
        ) from error
    columns = {name: seconds(np.concatenate(parts[name])) for name in kept}
    units = {name: "s" if name in dates else form.units[name] for name in kept}
    return RecordTable(_trimmed(columns, texts), units, tuple(texts.values()), form.first_line)


def _may_be_dates(name: str, form: CsvFormat, choice: Choice) -> bool:
    """Tell whether a column of dates may be one of times, and is not wanted as a signal."""
    is_signal = name in (choice.names or ())
    return name == choice.time or (not is_signal and may_be_time(name, form.units[name]))


def find_format(path: Path, choice: Choice) -> CsvFormat:
    """Find the format of a text file from its first lines.

    The names stand above the first row of samples, perhaps with a line of units between them;
    lines above the names are titles. The line of names may begin with ``#`` or ``%``. A first
    column without a name is the index of a table of pandas.

    Raises:
        RecordError: there is no header, no number below it, or no certain decimal sign.
    """
    encoding, lines = _first_lines(path, choice.path)
    separator, decimal = _signs([line for line in lines[1:] if line.strip()][-LOOKED_AT:])
    rows = _without_titles([_fields(line.lstrip("#% "), separator) for line in lines], choice)
    first = _first_row(rows, decimal)
    above = [k for k in range(first) if any(rows[k])]
    if not above:
        raise RecordError(
            f"{choice.path}, line 1 has {lines[0][:60]!r}; expected the names of the columns: a "
            "header is required, and no title above it that has as many values"
        )
    if separator == decimal:
        _require_decimals([field for row in rows[first:] for field in row], choice.path)
    header, units = rows[above[-1]], []
    width = len(rows[first]) if first < len(rows) else len(header)
    if len(above) > 1 and len(rows[above[-2]]) == len(header) == width > 1:
        header, units = rows[above[-2]], header
    own_units = named(_completed(header), choice.path)
    for column, unit in zip(own_units, units, strict=False):
        own_units[column] = own_units[column] or _bare(unit)
    looked_at = rows[first : first + LOOKED_AT]
    dates = [
        column
        for index, column in enumerate(own_units)
        if any(DATE.match(row[index]) for row in looked_at if index < len(row))
    ]
    return CsvFormat(encoding, separator, decimal, own_units, tuple(dates), above[-1] + 2)


def read_fields(path: Path) -> tuple[list[list[str]], str]:
    """Return the fields of all lines of a text file but empty ones, and its decimal sign.

    Separator and sign are found as for records, but names stay as they are written.

    Raises:
        RecordError: the file has fewer than two lines.
        csv.Error: a field is too long.
    """
    encoding, lines = _first_lines(path, str(path))
    separator, decimal = _signs([line for line in lines[1:] if line.strip()][-LOOKED_AT:])
    text = path.read_text(encoding=encoding, errors="replace")
    return [_fields(line, separator) for line in text.splitlines() if line.strip()], decimal


def _first_lines(path: Path, name: str) -> tuple[str, list[str]]:
    """Return the encoding of a file and its first lines, of which there are at least two."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    encoding = _encoding(head)
    lines = head.decode(encoding, errors="replace").splitlines()
    lines = lines[: -1 if len(head) == HEAD else None]  # the last line may be cut
    if len(lines) < 2:
        raise RecordError(
            f"{name} has {len(lines)} lines within its first {len(head)} bytes; expected a header "
            "with the names of the columns, and a line for each sample: is it a text file?"
        )
    return encoding, lines


def _encoding(head: bytes) -> str:
    """Return the encoding of a file: UTF-8, or else the code page of Windows."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        head[: max(0, len(head) - 3)].decode("utf-8")  # the last character may be cut
    except UnicodeDecodeError as error:
        if error.reason != "unexpected end of data":
            return "cp1252"
    return "utf-8-sig"


def _signs(lines: Sequence[str]) -> tuple[str, str]:
    """Find separator and decimal sign: most fields are values, with equal numbers in all lines."""
    best, signs = (False, -1.0, 0), (",", ".")
    for separator in SEPARATORS:
        rows = [_fields(line, separator) for line in reversed(lines)]  # titles last
        width = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
        total = max(1, sum(max(width, len(row)) for row in rows))
        for decimal in ".,":
            fields = [field for row in rows if len(row) == width for field in row]
            read = sum(
                VALUES[decimal].fullmatch(f) is not None or bool(DATE.match(f)) for f in fields
            )
            score = (width > 1 and read / total > ROW, round(read / total, 3), width)
            if score > best:
                best, signs = score, (separator, decimal)
    return signs


def _fields(line: str, separator: str) -> list[str]:
    """Split a line; a unit in brackets stays with its name where blanks separate."""
    if separator == BLANKS:
        return re.sub(r"\s+(?=[\[(])", "", line).split()
    read = csv.reader([line], delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in next(read, [])]


def _without_titles(rows: Sequence[list[str]], choice: Choice) -> list[list[str]]:
    """Empty the lines above the first one that has most of these: all wanted names, and a time."""
    wanted = {name for name in (*(choice.names or ()), choice.time) if name}
    scores = [(False, False)] * min(len(rows), LOOKED_AT)
    for k in range(len(scores)):
        with suppress(RecordError):  # a line without a name for each column has no names
            units = named(_completed(rows[k]), choice.path)
            has_time = not choice.step and any(may_be_time(*column) for column in units.items())
            scores[k] = bool(wanted) and wanted <= units.keys(), has_time
    titles = scores.index(max(scores))
    return [[]] * titles + list(rows[titles:])


def _require_decimals(fields: Iterable[str], path: str) -> None:
    """Refuse fields within quotes where all commas in numbers may group thousands."""
    numbers = [one for one in fields if "," in one and VALUES[","].fullmatch(one)]
    if numbers and all(map(GROUPED.fullmatch, numbers)):
        raise RecordError(
            f"{path} has {numbers[0]!r}, whose comma may group thousands, as all others may; "
            "expected at least one that is certainly a decimal sign, as in '0,5': write decimal "
            "points, and nothing between thousands"
        )


def _is_row(fields: list[str], decimal: str) -> bool:
    """Tell whether a line is a sample, by how many of its fields are numbers or dates."""
    filled = [field for field in fields if field]
    values = [f for f in filled if VALUES[decimal].fullmatch(f) or DATE.match(f)]
    return len(values) > ROW * len(filled)


def _first_row(rows: Sequence[list[str]], decimal: str) -> int:
    """Return the index of the first row of samples; the number of rows without one.

    A line with numbers is a title if the next line that is not empty has other fields than it, or
    if most lines have another number of fields. It holds the names if no line above has as many
    fields, and a field is a text where the next line has a number, as in ``time,1,2``.
    """
    filled = [k for k, row in enumerate(rows) if any(row)]
    widths = Counter(len(rows[k]) for k in filled)
    width = max(widths, key=lambda each: widths[each], default=0)
    for k, following in zip(filled, [*filled[1:], *filled[-1:]], strict=True):
        is_like = len(rows[following]) == len(rows[k]) or _is_row(rows[following], decimal)
        # above the names there may be titles of other widths, but no line as wide as samples
        is_like = is_like and (len(rows[k]) == width or width in map(len, rows[:k]))
        named_above = any(len(row) == len(rows[k]) for row in rows[:k])
        is_sample = named_above or not _holds_names(rows[k], rows[following], decimal)
        if _is_row(rows[k], decimal) and is_like and is_sample:
            return k
    return len(rows)


def _holds_names(row: list[str], following: list[str], decimal: str) -> bool:
    """Tell whether a field of a row is a text where the row below has a number or a date."""
    return any(
        one and not _is_row([one], decimal) and _is_row([below], decimal)
        for one, below in zip(row, following, strict=False)
    )


def _completed(header: list[str]) -> list[str]:
    """Leave out fields behind a last separator, and give the index of a table a name."""
    if len(header) > 1 and not header[-1]:
        header = header[:-1]  # every line ends with a separator
    if len(header) > 1 and not header[0]:
        header = [INDEX[0], *header[1:]]
    return header


def _bare(unit: str) -> str:
    """Return a unit without the brackets around it."""
    match = UNIT.fullmatch(f"x{unit}")
    return ((match[2] or match[3] or "") if match else unit).strip()


def _chunks(pandas: Any, path: Path, form: CsvFormat, choice: Choice) -> Iterator[tuple[int, Any]]:
    """Read tables of some lines, each with the number of samples before it.

    All columns are read, since pandas does not notice surplus values where some are left out.

    Raises:
        RecordError: the numbers of values and names differ in a line; a last separator does not
            count.
    """
    width, samples, is_short = len(form.units), 0, False
    with pandas.read_csv(
        path,
        sep=form.separator,
        decimal=form.decimal,
        encoding=form.encoding,
        encoding_errors="replace",
        header=None,
        skiprows=form.first_line - 1,
        skip_blank_lines=False,
        skipinitialspace=True,
        na_values=list(MISSING),
        chunksize=max(1, CHUNK // width),
        low_memory=False,
    ) as chunks:
        for chunk in chunks:
            surplus = np.flatnonzero(chunk.iloc[:, width:].notna().any(axis=1).to_numpy())
            if chunk.shape[1] < width or len(surplus):
                line = form.first_line + samples + (int(surplus[0]) if len(surplus) else 0)
                raise _wrong_width(choice.path, line, chunk.shape[1], width)
            filled = chunk.iloc[:, : width - 1].notna().any(axis=1)
            is_short = is_short or bool((filled & chunk.iloc[:, width - 1].isna()).any())
            yield samples, chunk
            samples += len(chunk)
    if is_short:  # pandas gives NaN for values that are not there, as for empty ones
        with path.open(encoding=form.encoding, errors="replace", newline="") as file:
            for line, count in enumerate(_counts(file, form), form.first_line):
                if 0 < count < width:
                    raise _wrong_width(choice.path, line, count, width)


def _counts(file: Iterable[str], form: CsvFormat) -> Iterator[int]:
    """Count the values in each line of samples."""
    lines = islice(file, form.first_line - 1, None)
    if form.separator == BLANKS:
        return (len(line.split()) for line in lines)
    rows = csv.reader(lines, delimiter=form.separator, skipinitialspace=True)
    return (len(row) for row in rows)


def _wrong_width(path: str, line: int, count: int, width: int) -> RecordError:
    return RecordError(
        f"{path}, line {line} has {count} values; expected {width} values in each line, as many "
        "as there are names: correct the file"
    )


def _trimmed(columns: dict[str, FloatArray], texts: dict[str, Text]) -> dict[str, FloatArray]:
    """Leave out samples without any value at the end."""
    filled = [np.flatnonzero(~np.isnan(values)) for values in columns.values()]
    ends = [int(samples[-1]) + 1 for samples in filled if len(samples)]
    end = max([*ends, *(text.sample + 1 for text in texts.values())], default=0)
    return {name: values[:end] for name, values in columns.items()}
