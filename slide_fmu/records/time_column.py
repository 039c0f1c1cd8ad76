"""Which columns of a file are times, by their names and units, and what they are in seconds."""

from __future__ import annotations

import re

import numpy as np

from slide_fmu.core.signals import FloatArray

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
    """Tell whether a column has times, by its name and unit; an index has if it is of dates."""
    if name in INDEX:
        return unit == "s"
    return TIME.fullmatch(name) is not None and unit.lower() in SECONDS


def may_be_time(name: str, unit: str) -> bool:
    """Tell whether a column may be one of times, before it is known whether it has dates."""
    return name in INDEX or is_time(name, unit)


def told_unit(name: str, unit: str) -> str:
    """Give the unit of times, in small letters, or the one that ends their name; else nothing."""
    match = TIME.fullmatch(name)
    return unit.lower() or ((match["unit"] or "").lower() if match else "")


def in_seconds(name: str, unit: str, values: FloatArray) -> FloatArray:
    """Convert times, shape (N,), to s by their unit, or by the unit that ends their name."""
    return values * SECONDS[told_unit(name, unit)]


def counts_samples(name: str, values: FloatArray) -> bool:
    """Tell whether a column is an index that counts samples, which is neither time nor signal."""
    return name in INDEX and bool(np.all(np.diff(values) == 1))


def rises(values: FloatArray) -> bool:
    """Tell whether values, shape (N,), rise as times do, of which a few may fall back."""
    differences = np.diff(values[np.isfinite(values)])
    return bool(np.count_nonzero(differences < 0) <= FALLING * len(differences))
