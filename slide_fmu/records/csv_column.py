"""One column of a text file: its numbers or dates, and the texts among them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.record import Text

DATE = r"\d{4}-\d\d-\d\d[T ]\d\d"
"""What a date and time of day begin with, as of ISO 8601."""


class CsvColumn:
    """A CsvColumn is read chunk by chunk. Final.

    Attributes:
        text: what was found in place of numbers; None if nothing was.
    """

    def __init__(self, pandas: Any, name: str, decimal: str, may_have_dates: bool) -> None:
        self._pandas, self._name, self._decimal = pandas, name, decimal
        self._may_have_dates = may_have_dates
        self._first: Any = None
        self._parts: list[FloatArray] = []
        self.text: Text | None = None

    @property
    def is_dates(self) -> bool:
        """Tell whether the values were dates; they are seconds since the first of them."""
        return self._first is not None

    def values(self) -> FloatArray:
        """Give all values and forget them, shape (N,), NaN where there is no number."""
        parts, self._parts = self._parts, []
        return np.concatenate(parts) if parts else np.empty(0)

    def add(self, chunk: Any, samples: int) -> None:
        """Add a chunk, a series of pandas, behind so many samples."""
        values = self._read(chunk)
        self._parts.append(values)
        wrong = np.flatnonzero(np.isnan(values) & ~chunk.isna().to_numpy())
        if not len(wrong):
            return
        if self.text is not None:
            self.text = replace(self.text, count=self.text.count + len(wrong))
        else:
            first = int(wrong[0])
            found = str(chunk.iloc[first])[:40]
            self.text = Text(self._name, len(wrong), samples + first, found)

    def _read(self, chunk: Any) -> FloatArray:
        types = self._pandas.api.types
        if types.is_bool_dtype(chunk) or types.is_numeric_dtype(chunk):
            return np.asarray(chunk.to_numpy(dtype=np.float64))
        written = chunk.astype("string").str.strip()
        if self._may_have_dates and bool(written.str.match(DATE).any()):
            return self._seconds(written)
        if self._decimal == ",":  # a point would separate thousands
            grouped = written.str.contains(".", regex=False)
            written = written.mask(grouped, "text").str.replace(",", ".", regex=False)
        numbers = self._pandas.to_numeric(written, errors="coerce")
        return np.asarray(numbers.to_numpy(dtype=np.float64, na_value=np.nan))

    def _seconds(self, written: Any) -> FloatArray:
        """Convert dates to seconds since the first one of the column; NaN for what is none."""
        dates = written.where(written.str.match(DATE)).str.replace(",", ".", regex=False)
        stamps = self._pandas.to_datetime(dates, format="ISO8601", errors="coerce", utc=True)
        known = stamps.dropna()
        if self._first is None and len(known):
            self._first = known.iloc[0]
        since = (stamps - self._first).to_numpy().astype("timedelta64[ns]")
        return np.where(np.isnat(since), np.nan, since.astype(np.float64) * 1e-9)
