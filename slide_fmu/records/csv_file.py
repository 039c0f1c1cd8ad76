"""Records in text files, read in chunks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.csv_column import CsvColumn
from slide_fmu.records.csv_format import NOTHING, CsvFormat, find_format
from slide_fmu.records.csv_lines import ShortLines, require_no_surplus
from slide_fmu.records.record import RecordError, Text
from slide_fmu.records.table import Choice, Table, library
from slide_fmu.records.time_column import may_be_time

CHUNK = 1_000_000
"""So many numbers are read at a time."""


def read_csv(path: Path, choice: Choice) -> Table:
    """Read the wanted columns of a text file, whose lines are samples, in chunks.

    Empty lines at its end are left out; an empty line elsewhere is a sample without values. Times
    may be dates as of ISO 8601, which become seconds since the first of them.

    Raises:
        RecordError: no header, wrong columns, lines with too many or too few values, or too many
            samples.
    """
    form = find_format(path, choice.path)
    pandas = library("pandas", choice.path)
    columns = {
        name: CsvColumn(pandas, name, form.decimal, _may_have_dates(name, form, choice))
        for name in choice.kept(form.units)
    }
    try:
        _read(pandas, path, (form, choice), columns)
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
    texts = {name: column.text for name, column in columns.items() if column.text is not None}
    return Table(
        _trimmed({name: column.values() for name, column in columns.items()}, texts),
        {name: "s" if column.is_dates else form.units[name] for name, column in columns.items()},
        tuple(texts.values()),
        form.first_line,
    )


def _may_have_dates(name: str, form: CsvFormat, choice: Choice) -> bool:
    """Tell whether a column may be one of times, which may be dates."""
    is_signal = name in (choice.names or ())
    return name == choice.time or (not is_signal and may_be_time(name, form.units[name]))


def _read(
    pandas: Any, path: Path, told: tuple[CsvFormat, Choice], columns: dict[str, CsvColumn]
) -> None:
    """Read all chunks into the columns."""
    form, choice = told
    places = {name: index for index, name in enumerate(form.units)}
    short = ShortLines(form)
    samples = 0
    with _chunks(pandas, path, form) as chunks:
        for chunk in chunks:
            require_no_surplus(chunk, samples, form, choice.path)
            short.look_at(chunk, samples)
            for name, column in columns.items():
                column.add(chunk[places[name]], samples)
            samples += len(chunk)
            choice.require_room(samples, len(columns), at_least=True)
    short.require_none(path, choice.path)


def _chunks(pandas: Any, path: Path, form: CsvFormat) -> Any:
    """Open the file for reading below the header, some lines at a time.

    All columns are read, since pandas does not notice surplus values where some are left out.
    """
    return pandas.read_csv(
        path,
        sep=form.separator,
        decimal=form.decimal,
        encoding=form.encoding,
        encoding_errors="replace",
        header=None,
        skiprows=form.first_line - 1,
        skip_blank_lines=False,
        skipinitialspace=True,
        na_values=[word for word in NOTHING if "inf" not in word],
        chunksize=max(1, CHUNK // len(form.units)),
        low_memory=False,
    )


def _trimmed(columns: dict[str, FloatArray], texts: dict[str, Text]) -> dict[str, FloatArray]:
    """Leave out samples without any value at the end."""
    filled = [np.flatnonzero(~np.isnan(values)) for values in columns.values()]
    ends = [int(found[-1]) + 1 for found in filled if len(found)]
    end = max([*ends, *(text.sample + 1 for text in texts.values())], default=0)
    return {name: values[:end] for name, values in columns.items()}
