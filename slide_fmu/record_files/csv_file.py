"""This module guesses the format of a text file, and reads its record with pandas in chunks.

Keys of the user take the place of each guess: separator, decimal sign, and line of the names.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.dates import Kind, is_time_text, joined, kind_of, seconds_of
from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.record_files.table import (
    HEADER,
    INDEX,
    SECONDS,
    Choice,
    RecordTable,
    TextForm,
    is_time,
    library,
    name_and_unit,
    named,
    numbers,
    text_among,
)

CHUNK = 1_000_000
"""Number of values that are read at a time."""

HEAD = 1024 * 1024
"""Number of bytes from which the format of the file is guessed."""

LOOKED_AT = 50
"""Largest number of lines from which separator, names and columns of dates are guessed."""

BLANKS = r"\s+"
"""Pattern of blanks as a separator, as pandas takes it."""

SEPARATORS = (";", "\t", "|", ",")
"""Separators that are tried in this order; blanks separate where none is in most lines."""

VALUES = {
    sign: re.compile(
        rf"[-+]?(\d+({re.escape(sign)}\d*)?|{re.escape(sign)}\d+)([eE][-+]?\d+)?"
        r"|(nan|na|n/a|null|none|[-+]?inf)?",
        re.IGNORECASE,
    )
    for sign in ".,"
}
"""Pattern of a value by its decimal sign: a number, or a mark of a missing one."""

DECIMALS = {sign: re.compile(rf"[-+]?\d*[{sign}]\d+([eE][-+]?\d+)?") for sign in ".,"}
"""Pattern of a number with decimals, by their sign."""

GROUPED = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""Pattern of a number whose comma may group thousands, or stand before the decimals."""

MISSING = ("na", "none")
"""Words for a missing number, in addition to the ones that pandas knows."""

ROW = 1 / 3
"""More than this part of the fields of a row of samples are numbers or times."""

FORM = (
    "correct the file, or say how it is written: --read separator=SIGN, decimal=SIGN or "
    "header=LINE in slide-fmu init, the same keys in system.parameters of a recipe"
)
"""The remedy for files whose format was guessed wrongly."""


@dataclass(frozen=True)
class CsvFormat:
    """A CsvFormat describes the format of a text file.

    Attributes:
        encoding: encoding of the characters.
        separator: separator of values, as pandas takes it.
        decimal: sign before the decimals, ``"."`` or ``","``.
        units: units by the names of the columns, in the order of the file; empty if not given.
        clocks: kinds of the columns in which the first samples have times as texts.
        first_line: line of the first sample; lines are counted from 1.
    """

    encoding: str
    separator: str
    decimal: str
    units: dict[str, str]
    clocks: dict[str, Kind]
    first_line: int


def read_csv(path: Path, choice: Choice) -> RecordTable:
    """Read the wanted columns of a text file, whose lines are samples, in chunks.

    Empty lines at its end are left out; an empty line elsewhere is a sample without values. Texts
    that are dates, times of day or lapses of time become times in s.

    Raises:
        RecordError: no header, wrong columns, lines with too many or too few values, or too many
            samples.
    """
    form = guess_format(path, choice)
    pandas = library("pandas", choice.path)
    signals = set(choice.names or ()) - {choice.time}
    clocks = {name: kind for name, kind in form.clocks.items() if name not in signals}
    kept = choice.kept(form.units, clocks)
    parts: dict[str, list[Any]] = {name: [] for name in kept}
    texts: dict[str, Text] = {}
    try:
        for samples, chunk in _chunks(pandas, path, form, choice):
            choice.require_room(samples + len(chunk), len(kept), at_least=True)
            for name in kept:
                raw = chunk[list(form.units).index(name)]
                if name in clocks:
                    parts[name].append(raw)
                    continue
                values = numbers(raw, form.decimal)
                parts[name].append(values)
                _note(texts, text_among(name, raw, values, samples))
    except pandas.errors.EmptyDataError as error:
        raise RecordError(
            f"{choice.path} has nothing from line {form.first_line} on; expected a line for each "
            "sample there: is the file whole?"
        ) from error
    except (pandas.errors.ParserError, UnicodeError) as error:
        raise RecordError(
            f"{choice.path}: {str(error).strip()}; expected {len(form.units)} values in each "
            f"line, as many as there are names: {FORM}"
        ) from error
    times: dict[str, FloatArray] = {}
    for name in (name for name in kept if name in clocks):
        raw = pandas.concat(parts[name], ignore_index=True)
        times[name] = seconds_of(raw, clocks[name])
        _note(texts, text_among(name, raw, times[name]))
    joint = joined(times, clocks)
    columns = {
        name: joint[name] if name in joint else np.concatenate(parts[name])
        for name in kept
        if name in joint or name not in clocks
    }
    units = {name: "s" if name in clocks else form.units[name] for name in columns}
    return RecordTable(
        _trimmed(columns, texts), units, tuple(texts.values()), form.first_line, tuple(joint)
    )


def _note(texts: dict[str, Text], text: Text | None) -> None:
    """Add a text of a further chunk to those of its column."""
    if text is not None:
        first = texts.get(text.column, replace(text, count=0))
        texts[text.column] = replace(first, count=first.count + text.count)


def guess_format(path: Path, choice: Choice) -> CsvFormat:
    """Guess the format of a text file from its first lines, where the choice does not give it.

    The names stand in the last line that has no sample, and in the one above it if it has units:
    a unit of time below a name of times. Lines above are titles. The line of names may begin with
    ``#`` or ``%``. A first column without a name is the index of a table of pandas.

    Raises:
        RecordError: there is no header, a first sample with more values than names, or no certain
            decimal sign.
    """
    encoding, lines = _first_lines(path, choice.path)
    separator, decimal = _signs(lines, choice.form)
    rows = [_fields(line.lstrip("#% "), separator) for line in lines]
    names, first = _header(rows, decimal, choice)
    if separator == decimal and choice.form.decimal is None:
        _require_decimals([field for row in rows[first:] for field in row], choice.path)
    units = rows[names + 1] if first > names + 1 else []
    own_units = named(_completed(rows[names]), choice.path)
    below = next((k for k in range(first, len(rows)) if any(rows[k])), len(rows))
    surplus = rows[below][len(own_units) :] if below < len(rows) else []
    if any(surplus):
        raise _wrong_width(choice.path, below + 1, len(rows[below]), len(own_units))
    for column, unit in zip(own_units, units, strict=False):
        own_units[column] = own_units[column] or _bare(unit)
    whole = (row for row in rows[first : first + LOOKED_AT] if len(row) >= len(own_units))
    columns = zip(*whole, strict=False)
    kinds = {name: kind_of(texts) for name, texts in zip(own_units, columns, strict=False)}
    clocks = {name: kind for name, kind in kinds.items() if kind is not None}
    return CsvFormat(encoding, separator, decimal, own_units, clocks, first + 1)


def read_fields(path: Path) -> tuple[list[list[str]], str]:
    """Return the fields of all lines of a text file but empty ones, and its decimal sign.

    Separator and sign are guessed as for records, but names stay as they are written.

    Raises:
        RecordError: the file has fewer than two lines.
        csv.Error: a field is too long.
    """
    encoding, lines = _first_lines(path, str(path))
    separator, decimal = _signs(lines, TextForm())
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


def _signs(lines: Sequence[str], form: TextForm) -> tuple[str, str]:
    """Return separator and decimal sign: those that are given, or else guesses by last lines."""
    last = [line for line in lines[1:] if line.strip()][-LOOKED_AT:]
    separator = form.separator or next(
        (sign for sign in SEPARATORS if 2 * sum(sign in line for line in last) > len(last)), " "
    )
    separator = BLANKS if separator.isspace() and separator != "\t" else separator
    fields = [field for line in last for field in _fields(line, separator)]
    counts = {sign: sum(map(bool, map(DECIMALS[sign].fullmatch, fields))) for sign in ".,"}
    return separator, form.decimal or ("," if counts[","] > counts["."] else ".")


def _fields(line: str, separator: str) -> list[str]:
    """Split a line; a unit in brackets stays with its name where blanks separate."""
    if separator == BLANKS:
        return re.sub(r"\s+(?=[\[(])", "", line).split()
    read = csv.reader([line], delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in next(read, [])]


def _header(rows: Sequence[list[str]], decimal: str, choice: Choice) -> tuple[int, int]:
    """Return the indices of the row of names, and of the first row of samples."""
    if choice.form.header is not None:
        names = choice.form.header - 1
        if not (0 <= names < len(rows) and any(rows[names])):
            raise RecordError(
                f"{choice.path} has no names in line {choice.form.header}, the given header; "
                f"expected the line with the names of the columns: {HEADER}"
            )
        below = rows[names + 1] if names + 1 < len(rows) else []
        has_units = len(below) == len(rows[names]) and not _is_row(below, decimal)
        return names, names + (2 if has_units else 1)
    above = [k for k in range(min(len(rows), LOOKED_AT)) if any(rows[k])]
    above = [k for k in above if not _is_row(rows[k], decimal)]
    if not above:
        raise RecordError(
            f"{choice.path}, line 1 has {' '.join(rows[0])[:60]!r}; expected the names of the "
            f"columns: a header is required. If the names are numbers: {HEADER}"
        )
    last = above[-1]
    return (last - 1 if _has_units(rows, last) else last), last + 1


def _has_units(rows: Sequence[list[str]], row: int) -> bool:
    """Tell whether a row has units of the names above: a unit of time below a name of times."""
    if not 0 < row < len(rows) or len(rows[row]) != len(rows[row - 1]):
        return False
    pairs = zip(rows[row - 1], map(_bare, rows[row]), strict=True)
    return any(unit and unit.lower() in SECONDS and is_time(name, unit) for name, unit in pairs)


def _require_decimals(fields: Iterable[str], path: str) -> None:
    """Refuse fields within quotes where all commas in numbers may group thousands."""
    numbers = [one for one in fields if DECIMALS[","].fullmatch(one)]
    if numbers and all(map(GROUPED.fullmatch, numbers)):
        raise RecordError(
            f"{path} has {numbers[0]!r}, whose comma may group thousands, as all others may; "
            "expected at least one that is certainly a decimal sign, as in '0,5': write decimal "
            "points, and nothing between thousands, or give the key decimal"
        )


def _is_row(fields: list[str], decimal: str) -> bool:
    """Tell whether a line is a sample, by how many of its fields are numbers or times."""
    filled = [field for field in fields if field]
    values = [f for f in filled if VALUES[decimal].fullmatch(f) or is_time_text(f)]
    return len(values) > ROW * len(filled)


def _completed(header: list[str]) -> list[str]:
    """Leave out fields behind a last separator, and give the index of a table a name."""
    if len(header) > 1 and not header[-1]:
        header = header[:-1]  # every line ends with a separator
    if len(header) > 1 and not header[0]:
        header = [INDEX[0], *header[1:]]
    return header


def _bare(unit: str) -> str:
    """Return a unit without the brackets around it."""
    return name_and_unit(f"x {unit}")[1] or unit.strip()


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
        f"as there are names: {FORM}"
    )


def _trimmed(columns: dict[str, FloatArray], texts: dict[str, Text]) -> dict[str, FloatArray]:
    """Leave out samples without any value at the end."""
    filled = [np.flatnonzero(~np.isnan(values)) for values in columns.values()]
    ends = [int(samples[-1]) + 1 for samples in filled if len(samples)]
    end = max([*ends, *(text.sample + 1 for text in texts.values())], default=0)
    return {name: values[:end] for name, values in columns.items()}
