"""This module reads times that are texts: dates, times of day, both, and lapses of time."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np

from slide_fmu.core.signals import FloatArray

Kind = Literal["stamp", "date", "clock", "lapse"]
"""A stamp has date and time of day, a clock the time of day alone, a lapse counts from a start."""

MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DATE = (
    r"(?:\d{4}[./-]\d\d?[./-]\d\d?|\d\d?[./-]\d\d?[./-]\d{4}"
    rf"|\d\d?\.\d\d?\.\d\d|\d\d?/\d\d?/\d\d|\d\d?-(?i:{'|'.join(MONTHS)})-\d{{4}})"
)
_CLOCK = r"\d\d?:\d\d(?::\d\d(?:[.,]\d+|:\d{3})?)?(?:\s?[AaPp]\.?[Mm]\.?)?"
PATTERNS: dict[Kind, re.Pattern[str]] = {
    "stamp": re.compile(rf"{_DATE}[T ]{_CLOCK}\s?(?:Z|UTC|[-+]\d\d:?\d\d)?"),
    "date": re.compile(_DATE),
    "clock": re.compile(_CLOCK),
    "lapse": re.compile(rf"-?\d+ days?,?(?: \+?{_CLOCK})?"),
}
"""Patterns of texts that are times. Dates begin or end with the year, which may have two digits
at the end; hours may be those of half a day."""

ENDS_WITH_YEAR = r"(\d\d?)[./-](\d\d?)[./-](\d{4}|\d\d(?!\d))"
OF_HALF_A_DAY = r"^(.*?)(\d\d?)(:[\d:.]+)\s?([AaPp])\.?[Mm]\.?$"

DAY = 86_400.0
"""A day in s; a clock that falls by half of it has passed midnight."""


def is_time_text(text: str) -> bool:
    """Tell whether a text is a time of some kind."""
    return any(pattern.fullmatch(text) for pattern in PATTERNS.values())


def kind_of(texts: Iterable[str]) -> Kind | None:
    """Return the kind of times that most of some texts are; None where they are none."""
    filled = [text.strip() for text in texts if text.strip()]
    for kind, pattern in PATTERNS.items():
        if 2 * sum(pattern.fullmatch(text) is not None for text in filled) > len(filled):
            return kind
    return None


def seconds_of(series: Any, kind: Kind) -> FloatArray:
    """Convert the texts of a series of pandas to s, shape (N,); what is no such text is NaN.

    Dates count from the first one, times of day from midnight; a day is added where they pass
    midnight.
    """
    pandas = importlib.import_module("pandas")
    texts = series.astype("string").str.strip()
    texts = texts.where(texts.str.fullmatch(PATTERNS[kind].pattern).fillna(False))
    texts = texts.str.replace(",", "." if kind != "lapse" else "", regex=False)
    texts = _of_whole_days(texts.str.replace(r"(?<=:\d\d):(\d{3})", r".\1", regex=True))
    if kind in ("clock", "lapse"):
        short = texts.str.fullmatch(r"\d\d?:\d\d").fillna(False)
        lapses = pandas.to_timedelta(texts.where(~short, texts + ":00"), errors="coerce")
        values = np.asarray(lapses.dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan))
        return past_midnight(values) if kind == "clock" else values
    return since_first(_stamps(pandas, texts))


def _of_whole_days(texts: Any) -> Any:
    """Return texts with hours from 0 to 23, where AM and PM told those of half a day apart."""
    parts = texts.str.extract(OF_HALF_A_DAY)
    halved = parts[0].notna()
    if not halved.any():
        return texts
    later = parts[3].str.lower() == "p"
    hours = parts[1].astype("Int64") % 12 + 12 * later.astype("Int64")
    whole = parts[0] + hours.astype("string").str.zfill(2) + parts[2]
    return texts.where(~halved, whole)


def _stamps(pandas: Any, texts: Any) -> Any:
    """Return dates of texts as times of pandas.

    Where the year stands last, the day comes first, unless that is no date. If several orders are
    possible and no point separates them, the one counts with which the record is shorter.
    """
    parts = texts.str.extract(f"^{ENDS_WITH_YEAR}(.*)$")
    if parts[0].isna().all():
        return _parsed(pandas, texts)
    first, second, last, clock = (parts[number] for number in range(4))
    is_short = last.str.len() == 2
    year = last.where(~is_short, "20" + last)
    day_first = _parsed(pandas, year + "-" + second + "-" + first + clock)
    if texts.str.contains(r"^\d+\.", regex=True).any():
        return day_first
    orders = [day_first, _parsed(pandas, year + "-" + first + "-" + second + clock)]
    if is_short.all():
        orders.append(
            _parsed(pandas, "20" + first.str.zfill(2) + "-" + second + "-" + last + clock)
        )
    return min(orders, key=lambda times: (times.isna().sum(), times.max() - times.min()))


def _parsed(pandas: Any, texts: Any) -> Any:
    texts = texts.str.replace(r"^(\d{4})[./](\d\d?)[./]", r"\1-\2-", regex=True)
    named = texts.str.extract(r"^(\d\d?)-([A-Za-z]{3})-(\d{4})(.*)$")
    if named[0].notna().any():
        numbers = {name: f"{number + 1:02d}" for number, name in enumerate(MONTHS)}
        month = named[1].str.lower().map(numbers).astype("string")
        whole = named[2] + "-" + month + "-" + named[0] + named[3]
        texts = texts.where(named[0].isna(), whole)
    padded = texts.str.replace(r"(?<=-)(\d)(?=-|[T ]|$)", r"0\1", regex=True)
    padded = padded.str.replace(r"(?<=[T ])(\d)(?=:)", r"0\1", regex=True)
    return pandas.to_datetime(padded, format="ISO8601", errors="coerce", utc=True)


def since_first(stamps: Any) -> FloatArray:
    """Convert dates of pandas to s since the first of them, shape (N,)."""
    values = np.asarray(stamps.to_numpy(dtype="datetime64[ns]"))
    known = values[~np.isnat(values)]
    since = (values - known[0]).astype(np.float64) if len(known) else np.zeros(len(values))
    return np.where(np.isnat(values), np.nan, since * 1e-9)


def past_midnight(values: FloatArray) -> FloatArray:
    """Add a day to times of day in s, shape (N,), wherever they have passed midnight."""
    known = np.flatnonzero(np.isfinite(values))
    whole = values.copy()
    passed = np.concatenate([[False], np.diff(values[known]) < -0.5 * DAY])
    whole[known] += DAY * np.cumsum(passed)
    return whole


def joined(columns: Mapping[str, FloatArray], kinds: Mapping[str, Kind]) -> dict[str, FloatArray]:
    """Return the columns of times, where dates are added to the times of day beside them.

    Args:
        columns: times in s by name, shape (N,) each.
        kinds: their kinds.
    """
    dates = [name for name in columns if kinds[name] == "date"]
    clocks = [name for name in columns if kinds[name] == "clock"]
    if len(dates) != 1 or len(clocks) != 1:
        return dict(columns)
    date, clock = columns[dates[0]], columns[clocks[0]]
    day = DAY * np.floor(clock / DAY)  # of midnights that were passed, which the date has too
    return {name: values for name, values in columns.items() if name != dates[0]} | {
        clocks[0]: date + clock - day
    }
