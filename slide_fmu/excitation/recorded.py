"""The user's own recorded inputs drive the system: cut, scaled, resampled to the recipe's step."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from slide_fmu.core.search_path import find_file
from slide_fmu.core.signals import FloatArray, Signal, cosines_of
from slide_fmu.core.units import behind
from slide_fmu.excitation.base import Kind, PositiveRange
from slide_fmu.excitation.descriptions import between

TIME = "time"
"""The usual name of the column of times, and its name in the key ``columns``."""

GRID = 10_000
"""Number of times in a file at which its inputs are compared with their ranges."""

CLIPPED = 0.8
"""A file is refused if more than this fraction of it would be clipped: its unit differs."""


class Recorded(Kind):
    """The inputs come from a file: each trajectory takes a part of it with a random start.

    The file is CSV, with the names of its columns in the first line. One column is the time in s,
    which rises; the others are inputs, in their units. Between samples an input moves linearly, or
    is held if it has a zero-order hold. A trajectory longer than the file goes through it
    forwards, then backwards, so that nothing jumps. Values beyond an input's range are clipped to
    its ends; ``try`` and ``run`` say how many.

    Attributes:
        path: the file, relative to the current folder or to the folder of the recipe.
        columns: names of columns by input, where they differ from the input's name; ``time`` is
            the column of times.
        scale: range of the factor on the deviations from the column means, drawn uniformly, once
            for all inputs.
        digest: SHA-256 of the file; it is added when the recipe is read. A file with another
            content is refused.

    Raises:
        ValueError: the file cannot be read, or is not the one of the digest.
    """

    kind: Literal["file"]
    path: str
    columns: dict[str, str] = Field(default={})
    scale: PositiveRange = (1.0, 1.0)
    digest: str | None = Field(default=None, repr=False)

    @property
    def _time(self) -> str:
        return self.columns.get(TIME, TIME)

    @model_validator(mode="before")
    @classmethod
    def _file_is_known(cls, values: Any) -> Any:
        if not isinstance(values, dict) or not isinstance(values.get("path"), str):
            return values
        content = _content(values["path"])
        digest = hashlib.sha256(content).hexdigest()
        given = values.get("digest")
        if given not in (None, digest):
            raise ValueError(
                f"path = {values['path']!r} has the SHA-256 {digest}; expected {given}: the file "
                "has changed since; remove the digest to use it as it is"
            )
        return {**values, "digest": digest}

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse a file that lacks an input or a rising time, or lies mostly outside a range.

        Raises:
            ValueError: the message names the fault in the file and the remedy.
        """
        table = _read(self.path, str(self.digest))
        wanted = [self._time, *(self.columns.get(s.name, s.name) for s in signals)]
        missing = [name for name in wanted if name not in table]
        if missing:
            raise ValueError(
                f"kind = 'file': {self.path!r} has no columns {missing}; it has {list(table)}: "
                f"say which is which with columns = {{ {TIME} = COLUMN, INPUT = COLUMN }}"
            )
        for name in wanted:
            wrong = np.flatnonzero(~np.isfinite(table[name]))
            if len(wrong):
                raise ValueError(
                    f"kind = 'file': {self.path!r}, column {name!r}, line {wrong[0] + 2} is no "
                    "finite number; expected numbers throughout: mend or cut the file"
                )
        steps = np.diff(table[self._time])
        if len(steps) == 0 or not (steps > 0).all():
            line = int(np.argmax(steps <= 0)) + 3 if len(steps) else 2
            raise ValueError(
                f"kind = 'file': {self.path!r}: the time does not rise at line {line}; expected "
                "at least two samples whose times rise"
            )
        for signal in signals:
            if signal.angle is None:
                self._require_mostly_in_range(signal, table[wanted[1 + signals.index(signal)]])

    def _require_mostly_in_range(self, signal: Signal, values: FloatArray) -> None:
        """Refuse values of which many would be clipped, as with another unit."""
        least = values.mean() + self.scale[0] * (values - values.mean())
        part = _share_outside(signal, least)
        if part > CLIPPED:
            raise ValueError(
                f"kind = 'file': {self.path!r}: {values.min():.4g} .. {values.max():.4g} for "
                f"{signal.name!r}, of range {signal.low:g} .. "
                f"{signal.high:g}{behind(signal.unit)}; "
                f"{100 * part:.0f} % of the values lie outside and would be clipped: give them in "
                f"{signal.unit}, widen the range, or lower the scale"
            )

    def shares_outside(self, signals: tuple[Signal, ...]) -> list[float]:
        """Return the share of time for which each input is clipped at the largest scale.

        Cosine and sine of an angle are never clipped.
        """
        table = _read(self.path, str(self.digest))
        times, shares = table[self._time], list[float]()
        grid = np.linspace(times[0], times[-1], GRID)
        for signal in signals:
            values = table[self.columns.get(signal.name, signal.name)]
            scaled = values.mean() + self.scale[1] * (values - values.mean())
            share = _share_outside(signal, _sampled(times, scaled, grid, signal))
            shares.append(share if signal.angle is None else 0.0)
        return shares

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        text = f"the inputs are parts of the file {Path(self.path).name}"
        if self.scale == (1.0, 1.0):
            return text
        return f"{text}, whose deviations from the means are scaled by {between(self.scale)}"

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Cut a part that begins at a random time, scale its deviations, and clip it.

        The amplitude factor multiplies the deviations from the column means and the range to which
        inputs are clipped. Cosine and sine of an angle are neither scaled nor clipped.
        """
        table = _read(self.path, str(self.digest))
        times = table[self._time] - table[self._time][0]
        elapsed = _to_and_fro(rng.uniform(0.0, times[-1]) + time - time[0], float(times[-1]))
        scale = factor * rng.uniform(*self.scale)
        turning = {index + i for index in cosines_of(signals) for i in (0, 1)}
        columns = []
        for index, signal in enumerate(signals):
            values = table[self.columns.get(signal.name, signal.name)]
            cut = _sampled(times, values, elapsed, signal)
            if index not in turning:
                middle, half = 0.5 * (signal.high + signal.low), 0.5 * (signal.high - signal.low)
                scaled = values.mean() + scale * (cut - values.mean())
                cut = np.clip(scaled, middle - factor * half, middle + factor * half)
            columns.append(cut)
        return np.stack(columns, axis=1)


def _share_outside(signal: Signal, values: FloatArray) -> float:
    """Return the share of values that lie outside of the range of a signal."""
    return float(np.mean((values < signal.low) | (values > signal.high)))


def _sampled(times: FloatArray, values: FloatArray, at: FloatArray, signal: Signal) -> FloatArray:
    """Return values (N,) at other times in s, by the signal's hold."""
    if signal.hold == "zero_order":
        return np.asarray(values[np.searchsorted(times, at, side="right") - 1])
    return np.interp(at, times, values)


def _to_and_fro(elapsed: FloatArray, length: float) -> FloatArray:
    """Fold rising times into a file's length: forwards, then backwards, and so on."""
    phase = np.mod(elapsed, 2 * length)
    return np.where(phase <= length, phase, 2 * length - phase)


def _content(path: str) -> bytes:
    try:
        return find_file(path).read_bytes()
    except OSError as error:
        raise ValueError(f"path = {path!r}: {error}") from error


@lru_cache(maxsize=8)
def _read(path: str, digest: str) -> dict[str, FloatArray]:
    """Read the columns of a file by name, once for each digest."""
    lines = _content(path).decode("utf-8-sig", errors="replace").splitlines()
    names = [name.strip().strip('"') for name in lines[0].split(",")] if lines else []
    wrong = [k for k, line in enumerate(lines, 1) if line.count(",") + 1 != len(names)]
    if len(lines) < 3 or wrong:
        where = f"; line {wrong[0]} has another number of values" if wrong else ""
        raise ValueError(
            f"kind = 'file': {path!r} has {len(lines)} lines and the names {names}{where}; "
            "expected columns of numbers, separated by commas, with their names in the first line"
        )
    values = np.genfromtxt(lines[1:], delimiter=",", ndmin=2)
    return dict(zip(names, values.T, strict=True))
