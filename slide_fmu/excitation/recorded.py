"""The user's own recorded inputs drive the system: cut, scaled, resampled to the recipe's step."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from slide_fmu.core.measures import percent
from slide_fmu.core.search_path import find_file
from slide_fmu.core.signals import FloatArray, Signal, cosines_of
from slide_fmu.core.units import behind
from slide_fmu.excitation.base import Kind, PositiveRange
from slide_fmu.excitation.descriptions import between
from slide_fmu.record_files.inputs import InputTable, duration_of, read_inputs

GRID = 10_000
"""Number of times in a file at which its inputs are compared with their ranges."""

CLIPPED = 0.8
"""A file is refused if more than this fraction of it would be clipped: its unit differs."""

REST = 0.25
"""Trajectories begin at most this part of their length before the file, at rest under its first
value, as an FMU does."""


class Recorded(Kind):
    """The inputs come from a file: each trajectory takes a part of it with a random start.

    The file is CSV, Parquet, HDF5, MAT or NumPy. One column is the time, which rises, at any
    clock; the others are inputs, in their units. Between samples an input moves linearly, or is
    held if it has a zero-order hold. Before the file inputs rest at their first values. A
    trajectory longer than the file goes through it forwards, then backwards, so that nothing
    jumps. Values beyond an input's range are clipped to its ends; ``try`` and ``run`` say how
    many. CSV, too, needs the extra ``records``.

    Attributes:
        path: the file, relative to the current folder or to the folder of the recipe.
        columns: names of columns by input, where they differ from the input's name; ``time`` is
            the column of times, which is found by its name if not given.
        scale: range of the factor on the deviations from the column means, drawn uniformly, once
            for all inputs.
        learnt: part of the file, in time from its beginning, of which trajectories are cut. The
            rest is never learnt: it judges the FMU, as the row "your inputs" of report and card.
            Values beyond a range are then refused. 0.5 is the first half; with 1 nothing judges.
        digest: SHA-256 of the file; it is added when the recipe is read. A file with another
            content is refused.

    Raises:
        ValueError: the file cannot be read, or is not the one of the digest.
    """

    bends: ClassVar[bool] = True  # a file may have several samples in a step, and bends at them

    kind: Literal["file"]
    path: str
    columns: dict[str, str] = Field(default={})
    scale: PositiveRange = (1.0, 1.0)
    learnt: Annotated[float, Field(gt=0, le=1)] = 1.0
    digest: str | None = Field(default=None, repr=False)

    @property
    def name(self) -> str:
        """The name of the file, without its folder."""
        return Path(self.path).name

    @property
    def judges(self) -> bool:
        """Whether a part of the file judges the FMU."""
        return self.learnt < 1.0

    def judging(self, name: str | None = None) -> str:
        """Return the part that judges the FMU in words; the file has its name, or another one."""
        part = "second half" if self.learnt == 0.5 else f"last {percent(1.0 - self.learnt)}"
        return f"{part} of {name or self.name}"

    @property
    def duration(self) -> float:
        """Time in s from the first to the last sample of the file.

        Raises:
            ValueError: the file cannot be read, or has no times that rise.
        """
        return duration_of(self.path, self.columns)

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

    def table(self, signals: tuple[Signal, ...]) -> InputTable:
        """Return the inputs of the file; it is read once for each digest.

        Raises:
            ValueError: the file lacks an input, or has faults (``read_inputs``).
        """
        return _table(self.path, str(self.digest), tuple(self.columns.items()), signals)

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse a file that lacks an input or a rising time, or lies mostly outside a range.

        Raises:
            ValueError: the message names the fault in the file and the remedy.
        """
        table = self.table(signals)
        if self.judges:
            table.require_in_range()
        for signal, values in zip(signals, table.values.T, strict=True):
            if signal.angle is None:
                self._require_mostly_in_range(signal, values)

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
        table = self.table(signals)
        mean = self._mean(table)
        sampled = table.at(np.linspace(0.0, self.learnt * table.duration, GRID))
        scaled = mean + self.scale[1] * (sampled - mean)
        return [
            _share_outside(signal, values) if signal.angle is None else 0.0
            for signal, values in zip(signals, scaled.T, strict=True)
        ]

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        of = f"the first {percent(self.learnt)}, in time, of " if self.judges else ""
        text = f"the inputs are parts of {of}the file {self.name}"
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
        table = self.table(signals)
        length, lasts = self.learnt * table.duration, float(time[-1] - time[0])
        latest = length - lasts if length >= lasts else length
        begin = rng.uniform(-REST * lasts, latest)
        inputs = table.at(_to_and_fro(np.maximum(begin + time - time[0], 0.0), length))
        scale, mean = factor * rng.uniform(*self.scale), self._mean(table)
        turning = {index + i for index in cosines_of(signals) for i in (0, 1)}
        for index, signal in enumerate(signals):
            if index not in turning:
                middle, half = 0.5 * (signal.high + signal.low), 0.5 * (signal.high - signal.low)
                scaled = mean[index] + scale * (inputs[:, index] - mean[index])
                inputs[:, index] = np.clip(scaled, middle - factor * half, middle + factor * half)
        return inputs

    def _mean(self, table: InputTable) -> FloatArray:
        """Return the means of the inputs, (n_inputs,), in the part that is learnt."""
        learnt = table.times <= self.learnt * table.duration
        return np.asarray(table.values[learnt].mean(axis=0))


def _share_outside(signal: Signal, values: FloatArray) -> float:
    """Return the share of values that lie outside of the range of a signal."""
    return float(np.mean((values < signal.low) | (values > signal.high)))


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
def _table(
    path: str, digest: str, columns: tuple[tuple[str, str], ...], signals: tuple[Signal, ...]
) -> InputTable:
    """Read the inputs of a file, once for each digest."""
    return read_inputs(path, signals, dict(columns))
