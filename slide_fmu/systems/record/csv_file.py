"""Records in text files, read in chunks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.record.csv_format import NOTHING, CsvFormat, find_format
from slide_fmu.systems.record.measured import RecordError, Text
from slide_fmu.systems.record.table import Choice, Table, library

CHUNK = 1_000_000
"""So many numbers are read at a time."""


def read_csv(path: Path, choice: Choice) -> Table:
    """Read the wanted columns of a text file, whose lines are samples, in chunks.

    Empty lines at its end are left out; an empty line elsewhere is a sample without values.

    Raises:
        RecordError: no header, wrong columns, lines with too many values, or too many samples.
    """
    form = find_format(path, choice.path)
    kept = choice.kept(form.units)
    pandas = library("pandas", choice.path)
    parts: dict[str, list[FloatArray]] = {name: [] for name in kept}
    texts: dict[str, Text] = {}
    places = {name: index for index, name in enumerate(form.units)}
    samples = 0
    try:
        with _chunks(pandas, path, form) as chunks:
            for chunk in chunks:
                _require_width(chunk, samples, form, choice.path)
                for name in kept:
                    values, text = _numbers(
                        pandas, chunk[places[name]], form.decimal, name, samples
                    )
                    parts[name].append(values)
                    if text is not None:
                        texts[name] = _joined(texts.get(name), text)
                samples += len(chunk)
                choice.require_room(samples, len(kept), at_least=True)
    except (pandas.errors.ParserError, UnicodeError) as error:
        raise RecordError(
            f"{choice.path}: {str(error).strip()}; expected {len(form.units)} values in each "
            "line, as many as there are names: correct the file"
        ) from error
    columns = {name: _whole(parts.pop(name)) for name in kept}
    return Table(
        _trimmed(columns, texts),
        {name: form.units[name] for name in kept},
        tuple(texts.values()),
        form.first_line,
    )


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


def _require_width(chunk: Any, samples: int, form: CsvFormat, path: str) -> None:
    """Refuse lines of fewer or more values than names; a last separator does not count."""
    width = len(form.units)
    wrong = np.flatnonzero(chunk.iloc[:, width:].notna().any(axis=1).to_numpy())
    if chunk.shape[1] < width or len(wrong):
        line = form.first_line + samples + (int(wrong[0]) if len(wrong) else 0)
        raise RecordError(
            f"{path}, line {line} has {chunk.shape[1]} values; expected {width} values in each "
            "line, as many as there are names: correct the file"
        )


def _numbers(
    pandas: Any, column: Any, decimal: str, name: str, samples: int
) -> tuple[FloatArray, Text | None]:
    """Give the numbers of one chunk of a column, NaN for texts; tell how many texts it has."""
    if pandas.api.types.is_bool_dtype(column) or pandas.api.types.is_numeric_dtype(column):
        return column.to_numpy(dtype=np.float64), None
    written = column.astype("string").str.strip()
    if decimal == ",":  # a point would separate thousands
        grouped = written.str.contains(".", regex=False)
        written = written.mask(grouped, "text").str.replace(",", ".", regex=False)
    values = pandas.to_numeric(written, errors="coerce").to_numpy(
        dtype=np.float64, na_value=np.nan
    )
    wrong = np.flatnonzero(np.isnan(values) & ~column.isna().to_numpy())
    if not len(wrong):
        return values, None
    first = int(wrong[0])
    return values, Text(name, len(wrong), samples + first, str(column.iloc[first])[:40])


def _joined(before: Text | None, text: Text) -> Text:
    if before is None:
        return text
    return Text(text.column, before.count + text.count, before.sample, before.value)


def _whole(parts: list[FloatArray]) -> FloatArray:
    return np.concatenate(parts) if parts else np.empty(0)


def _trimmed(columns: dict[str, FloatArray], texts: dict[str, Text]) -> dict[str, FloatArray]:
    """Leave out samples without any value at the end."""
    filled = [np.flatnonzero(~np.isnan(values)) for values in columns.values()]
    ends = [int(found[-1]) + 1 for found in filled if len(found)]
    end = max([*ends, *(text.sample + 1 for text in texts.values())], default=0)
    return {name: values[:end] for name, values in columns.items()}
