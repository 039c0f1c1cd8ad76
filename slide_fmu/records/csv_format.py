"""How a text file with columns is written: separator, decimal sign, names, units."""

from __future__ import annotations

import codecs
import csv
import re
from dataclasses import dataclass
from pathlib import Path

from slide_fmu.records.record import RecordError
from slide_fmu.records.table import UNIT, named
from slide_fmu.records.time_column import INDEX

HEAD = 1024 * 1024
"""So many bytes of the file are looked at to find out how it is written."""

LOOKED_AT = 50
"""So many lines of them at most."""

BLANKS = r"\s+"
"""What pandas calls blanks that separate."""

SEPARATORS = {";": ";", "\t": "\t", ",": ",", "|": "|", " ": BLANKS}
"""Separators that are tried, in this order, and what pandas calls them."""

NUMBERS = {
    sign: re.compile(rf"[-+]?(\d+({re.escape(sign)}\d*)?|{re.escape(sign)}\d+)([eE][-+]?\d+)?")
    for sign in ".,"
}
"""Numbers by their decimal sign."""

NOTHING = ("", "nan", "na", "n/a", "null", "none", "inf", "-inf", "+inf")
"""What stands in place of a number that is not there, or not finite, in small letters."""


@dataclass(frozen=True)
class CsvFormat:
    """A CsvFormat says how a text file is written.

    Attributes:
        separator: between values, as pandas knows it.
        decimal: sign before the decimals, ``"."`` or ``","``.
        encoding: of the characters.
        units: units by the names of the columns, in the order of the file; empty if not given.
        first_line: line of the first sample; lines are counted from 1.
    """

    separator: str
    decimal: str
    encoding: str
    units: dict[str, str]
    first_line: int


def find_format(path: Path, name: str) -> CsvFormat:
    """Find out how a text file is written, from its first lines.

    The names stand in the first line whose fields go together with the lines below; what stands
    above is a title. The line below the names may have units. A line that begins with ``#`` or
    ``%`` may have the names too. A first column without a name is the index of a table of pandas.

    Raises:
        RecordError: there is no header, or no number below it; the message says what was found.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
    encoding, text = _decoded(head)
    lines = text.splitlines()
    if len(head) == HEAD:
        lines = lines[:-1]  # the last one may be cut
    if len(lines) < 2:
        raise RecordError(
            f"{name} has {len(lines)} lines within its first {len(head)} bytes; expected a header "
            "with the names of the columns, and a line for each sample: is it a text file?"
        )
    titles = _titles(lines)
    separator, decimal = _signs(lines[titles:])[1]
    names = lines[titles]
    header = _fields(names.lstrip("#% "), separator)
    if all(_is_number(field, decimal) for field in header):
        raise RecordError(
            f"{name}, line {titles + 1} has {names[:60]!r}; expected the names of the columns: a "
            "header is required"
        )
    units = named(_completed(header), name)
    second = _fields(lines[titles + 1], separator)
    if not _are_units(second, decimal):
        return CsvFormat(SEPARATORS[separator], decimal, encoding, units, titles + 2)
    units = {
        key: own or _bare(field)
        for (key, own), field in zip(units.items(), _padded(second, len(units)), strict=True)
    }
    return CsvFormat(SEPARATORS[separator], decimal, encoding, units, titles + 3)


def _titles(lines: list[str]) -> int:
    """Count the lines above the names; none where no line goes together with those below it."""
    for index in range(min(LOOKED_AT, len(lines) - 1)):
        fits, (separator, decimal) = _signs(lines[index:])
        if lines[index].strip() and fits:
            fields = _fields(lines[index].lstrip("#% "), separator)
            return 0 if any(_is_number(field, decimal) for field in fields) else index
    return 0


def _completed(header: list[str]) -> list[str]:
    """Leave out what is behind a last separator, and give the index of a table its name."""
    if len(header) > 1 and not header[-1].strip():
        header = header[:-1]  # every line ends with a separator
    if len(header) > 1 and not header[0].strip():
        header = [INDEX[0], *header[1:]]
    return header


def _are_units(fields: list[str], decimal: str) -> bool:
    """Tell whether the fields of a line are units; a 1 among them is that of a ratio."""
    filled = [field.strip() for field in fields if field.strip()]
    values = [field for field in filled if _is_value(field, decimal)]
    return 2 * len(values) < len(filled) and all(field == "1" for field in values)


def _decoded(head: bytes) -> tuple[str, str]:
    """Decode the head of a file; what is no UTF-8 is taken as the code page of Windows."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16", head.decode("utf-16", errors="replace")
    try:
        # the last character may be cut
        decoder = codecs.getincrementaldecoder("utf-8-sig")()
        return "utf-8-sig", decoder.decode(head)
    except UnicodeDecodeError:
        return "cp1252", head.decode("cp1252", errors="replace")


def _signs(lines: list[str]) -> tuple[bool, tuple[str, str]]:
    """Find separator and decimal sign: with them most fields are numbers, as many as names.

    Returns:
        Whether there are several columns of which that is true, and both signs.
    """
    best, found = (False, -1.0, 0), (",", ".")
    below = [line for line in lines[1 : LOOKED_AT + 1] if line.strip()]
    for separator in SEPARATORS:
        width = len(_fields(lines[0].lstrip("#% "), separator))
        for decimal in ".,":
            if decimal == separator:
                continue
            rows = [_fields(line, separator) for line in below]
            values = [field for row in rows if len(row) == width for field in row]
            read = sum(_is_value(field, decimal) for field in values)
            all_fields = max(1, sum(max(width, len(row)) for row in rows))
            part = round(read / all_fields, 3)
            score = (width > 1 and part > 0.3, part, width)
            if score > best:
                best, found = score, (separator, decimal)
    return best[0], found


def _fields(line: str, separator: str) -> list[str]:
    """Split a line; a unit in brackets stays with its name where blanks separate."""
    if separator == " ":
        return re.sub(r"\s+(?=[\[(])", "", line).split()
    return next(csv.reader([line], delimiter=separator), [])


def _is_number(field: str, decimal: str) -> bool:
    return NUMBERS[decimal].fullmatch(field.strip()) is not None


def _is_value(field: str, decimal: str) -> bool:
    return _is_number(field, decimal) or field.strip().lower() in NOTHING


def _bare(field: str) -> str:
    """Give a unit without the brackets around it."""
    match = UNIT.fullmatch(f"x{field.strip()}")
    return ((match[2] or match[3] or "") if match else field).strip()


def _padded(fields: list[str], length: int) -> list[str]:
    return (fields + [""] * length)[:length]
