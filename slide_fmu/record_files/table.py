"""This module defines the choice of columns and the table of a reader, and finds times in it."""

from __future__ import annotations

import importlib
import re
from collections.abc import Container, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import MissingColumnsError, RecordError, Text

MOST_NUMBERS = 50_000_000
"""A record of more numbers, samples times columns, is refused: these take 400 MB of memory."""


@dataclass(frozen=True, eq=False)
class RecordTable:
    """A RecordTable is the content of a file, before it is known which column is the time.

    Attributes:
        columns: values by name, each of shape (N,).
        units: units by name; empty where the file has none.
        texts: texts in place of numbers; they are NaN in the columns.
        first_line: line of the first sample in the file; 0 where the file has no lines.
        clocks: columns that are times by their content, in s.
    """

    columns: dict[str, FloatArray]
    units: dict[str, str]
    texts: tuple[Text, ...] = field(default=())
    first_line: int = 0
    clocks: tuple[str, ...] = ()


@dataclass(frozen=True)
class TextForm:
    """A TextForm says how a text file is written, as far as the user knows; None is guessed.

    Attributes:
        separator: what separates values; a blank stands for any number of blanks.
        decimal: the sign before decimals, ``"."`` or ``","``.
        header: the line with the names of the columns, counted from 1.
    """

    separator: str | None = None
    decimal: str | None = None
    header: int | None = None


@dataclass(frozen=True)
class Choice:
    """A Choice names the wanted columns of a file.

    Attributes:
        path: the file, as the user named it.
        names: columns that are wanted; None for all.
        others: whether all other columns are wanted too.
        time: name of the column of times; None where it is to be found.
        step: whether the step is given, so that no column of times is needed.
        most: number of samples times columns that are read at most.
        form: how a text file is written.
        time_unit: unit of times that have none; empty where it is to be found.
    """

    path: str
    names: tuple[str, ...] | None = None
    others: bool = False
    time: str | None = None
    step: bool = False
    most: int = MOST_NUMBERS
    form: TextForm = field(default_factory=TextForm)
    time_unit: str = ""

    @property
    def all(self) -> bool:
        """Tell whether all columns are wanted."""
        return self.names is None or self.others

    def kept(self, units: dict[str, str], clocks: Container[str] = ()) -> list[str]:
        """Give the columns to read, in the order of the file, of all that it has.

        Those are the wanted ones, and those that may be times.

        Args:
            units: units of all columns by their names.
            clocks: columns that are times by their content.

        Raises:
            RecordError: a column that is wanted is not there.
        """
        wanted = [*(self.names or ()), *([self.time] if self.time else [])]
        missing = [name for name in wanted if name not in units]
        if missing:
            raise MissingColumnsError(self.path, missing, units)
        if self.all:
            return list(units)
        return [
            name
            for name, unit in units.items()
            if name in wanted or (not self.step and (name in clocks or is_time(name, unit)))
        ]

    def require_room(self, samples: int, columns: int, at_least: bool = False) -> None:
        """Refuse a record that is too large for the memory.

        Raises:
            RecordError: with the number of samples and columns, and how many may be read.
        """
        if samples * columns <= self.most:
            return
        more = "at least " if at_least else ""
        raise RecordError(
            f"{self.path} has {more}{samples} samples of {columns} columns to read; expected at "
            f"most {self.most // columns} samples of as many ({self.most} numbers): name only "
            "the columns that are needed, record with a longer step, or cut the file"
        )


UNIT = re.compile(r"(.*?\S)(\s*)(?:\[([^\]]*)\]|\(([^)]*)\))")
"""A name and its unit behind it, in brackets or parentheses."""

NUMBER = re.compile(r"[\d\s,:]+")
"""What is an index in brackets directly behind a name, as in ``q[0]``, and no unit."""


def named(header: Iterable[str], path: str) -> dict[str, str]:
    """Split ``name [unit]`` and ``name (unit)`` into units by names, in order.

    Raises:
        RecordError: a name is missing, or there twice.
    """
    units: dict[str, str] = {}
    for number, text in enumerate(header, 1):
        name, unit = name_and_unit(text.strip())
        if not name or name in units:
            what = f"twice the name {name!r}" if name else f"no name for column {number}"
            raise RecordError(
                f"{path} has {what}; expected one name for each column, each another: correct "
                f"the header, or name its line: {HEADER}"
            )
        units[name] = unit
    return units


def name_and_unit(text: str) -> tuple[str, str]:
    """Split a name and the unit behind it; the number in ``q[0]`` belongs to the name."""
    match = UNIT.fullmatch(text)
    if match is None:
        return text, ""
    unit = (match[3] or match[4] or "").strip()
    is_index = not match[2] and NUMBER.fullmatch(unit) is not None
    return (text, "") if is_index else (match[1], unit)


HEADER = "--read header=LINE in slide-fmu init, header = LINE in system.parameters of a recipe"
"""How a user says where the names of the columns are."""


def library(module: str, path: str) -> Any:
    """Import a library that a format needs.

    Raises:
        RecordError: it is not installed; the message names the extra.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise RecordError(
            f"{path}: no package {module.partition('.')[0]!r} is installed, which reads files of "
            "this format; expected the extra 'records': pip install 'slide-fmu[records]'"
        ) from error


def numbers(series: Any, decimal: str = ".") -> FloatArray:
    """Return the numbers of a series of pandas, NaN for texts, shape (N,).

    Args:
        series: values of one column, N of them.
        decimal: sign before the decimals of numbers that are written as texts.
    """
    pandas = importlib.import_module("pandas")
    types = pandas.api.types
    if types.is_bool_dtype(series) or types.is_numeric_dtype(series):
        return np.asarray(series.to_numpy(dtype=np.float64, na_value=np.nan))
    written = series.astype("string").str.strip()
    if decimal == ",":  # a point would separate thousands
        grouped = written.str.contains(".", regex=False)
        written = written.mask(grouped, "text").str.replace(",", ".", regex=False)
    read = pandas.to_numeric(written, errors="coerce")
    return np.asarray(read.to_numpy(dtype=np.float64, na_value=np.nan))


def text_among(name: str, series: Any, values: FloatArray, before: int = 0) -> Text | None:
    """Return the text in a series of pandas, whose values have NaN there, or None.

    Args:
        name: name of the column.
        before: number of samples before the series.
    """
    wrong = np.flatnonzero(np.isnan(values) & series.notna().to_numpy())
    if not len(wrong):
        return None
    return Text(name, len(wrong), before + int(wrong[0]), str(series.iloc[wrong[0]])[:40])


SECONDS = {
    "": 1.0,
    "s": 1.0,
    "sec": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,  # micro sign
    "μs": 1e-6,  # Greek mu
    "ns": 1e-9,
    "min": 60.0,
    "h": 3600.0,
}
"""Units of times, in s; times without a unit are in s."""

TIME = re.compile(
    r"(?:.*[/.])?(?:t|(?:[a-z0-9]+[_ ])?(?:time|times|timestamp|zeit))"
    r"(?:[_ ]?\d+)?(?:_(?P<unit>s|sec|ms|us|ns|min|h))?",
    re.IGNORECASE,
)
"""Names of columns of times, perhaps with a folder before them and a unit behind."""

INDEX = ("Unnamed: 0", "__index_level_0__")
"""What pandas calls the index of a table, if it has no name, in text and in Parquet files."""

FALLING = 0.1
"""A column that falls at more than this part of its samples is no clock: a temperature T, say."""


def is_time(name: str, unit: str) -> bool:
    """Tell whether a column has times, by its name and unit; an index may have."""
    return name in INDEX or (TIME.fullmatch(name) is not None and unit.lower() in SECONDS)


def unit_of_times(name: str, unit: str) -> str:
    """Give the unit of times, in small letters, or the one that ends their name; else nothing."""
    match = TIME.fullmatch(name)
    return unit.lower() or ((match["unit"] or "").lower() if match else "")


EPOCHS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Units of times since 1970, per s."""

SINCE_1970 = (6e8, 4.2e9)
"""Times in s from 1989 to 2103, counted from 1970: no record lasts so long."""


def epoch_of(values: FloatArray) -> str:
    """Return the unit of times without one, shape (N,), if they count from 1970; else nothing."""
    known = values[np.isfinite(values)]
    first = float(known[0]) if len(known) else 0.0
    units = [u for u, per_s in EPOCHS.items() if SINCE_1970[0] < first / per_s < SINCE_1970[1]]
    return units[0] if units else ""


def counts_samples(name: str, values: FloatArray) -> bool:
    """Tell whether a column is an index that counts samples, which is neither time nor signal."""
    return name in INDEX and bool(np.all(values == np.round(values)))


def rises(values: FloatArray) -> bool:
    """Tell whether values, shape (N,), rise as times do, of which a few may fall back."""
    differences = np.diff(values[np.isfinite(values)])
    return bool(np.count_nonzero(differences < 0) <= FALLING * len(differences))
