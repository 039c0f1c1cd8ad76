"""A measured record has columns of numbers over a time in seconds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.suggestions import or_meant

GIVE_STEP = (
    "give the step, so that the times are not used: --time none --step SECONDS in slide-fmu init, "
    "sample_step in system.parameters of a recipe"
)
"""The remedy for times that are wrong where samples are even."""


class RecordError(ValueError):
    """A record cannot be read, or cannot be used without a correction."""


class NoTimesError(RecordError):
    """A file has no column of times, and no step was given."""


class MissingColumnsError(RecordError):
    """A record lacks columns that are named.

    Attributes:
        missing: their names, at least one.
    """

    def __init__(self, path: str, missing: Sequence[str], columns: Iterable[str]) -> None:
        known = list(columns)
        super().__init__(
            f"{path} has no columns {list(missing)}; it has {shortened(known)}: name columns that "
            f"it has{or_meant(missing, known)}"
        )
        self.missing = tuple(missing)


def shortened(names: Iterable[str], most: int = 20) -> str:
    """Write names as a list, and leave out the end of a long one."""
    listed: Sequence[str] = list(names)
    more = f" and {len(listed) - most} more" if len(listed) > most else ""
    return f"{listed[:most]}{more}"


def files_named(paths: Sequence[str], most: int = 3) -> str:
    """Name files for a message; where there are many, the first of them and their number."""
    if len(paths) <= most:
        return ", ".join(paths)
    return f"{paths[0]}, {paths[1]} and {len(paths) - 2} more files"


@dataclass(frozen=True)
class Text:
    """A Text is a text in a column where a number was expected.

    Attributes:
        column: name of the column.
        count: how many of its values are texts.
        sample: index of the first of them.
        value: the first of them.
    """

    column: str
    count: int
    sample: int
    value: str


@dataclass(frozen=True, eq=False)
class Record:
    """A Record holds signals that were measured together.

    Attributes:
        time: times of the samples in s, shape (N,); as the file has them, so that they may jump
            or fall back.
        columns: values by name, each of shape (N,), in the units of ``units``; NaN where the file
            has nothing, or a text.
        units: units by name, as the file writes them; empty where it has none.
        path: the file, as it was named.
        digest: SHA-256 of the file.
        clock: name of the column that ``time`` comes from; None where the step was given.
        other_clocks: further columns of times, in s, by name, each of shape (N,).
        clock_is_chosen: whether the user named the column of times.
        texts: texts that were found in place of numbers.
        first_line: line of the first sample in the file; 0 where the file has no lines.
        clock_unit: unit of the times in the file; empty where they have none, and count as s.
        fill: up to this many missing samples in a row are to be filled; 0 for none.
        stuck: from so many equal values in a row on, they count as missing; 0 for never, None
            where nobody has said it.

    Raises:
        RecordError: the shapes do not fit.
    """

    time: FloatArray
    columns: dict[str, FloatArray]
    units: dict[str, str]
    path: str
    digest: str
    clock: str | None = None
    other_clocks: dict[str, FloatArray] = field(default_factory=dict)
    clock_is_chosen: bool = False
    texts: tuple[Text, ...] = ()
    first_line: int = 0
    clock_unit: str = "s"
    fill: int = 0
    stuck: int | None = None

    def __post_init__(self) -> None:
        shapes = {n: v.shape for n, v in {**self.columns, **self.other_clocks}.items()}
        wrong = {name: shape for name, shape in shapes.items() if shape != self.time.shape}
        if self.time.ndim != 1 or wrong:
            raise RecordError(
                f"{self.path}: time of shape {self.time.shape}, columns of shapes {wrong}; "
                "expected one axis, and the same length for all"
            )

    def chosen(self, names: tuple[str, ...]) -> FloatArray:
        """Return columns side by side, shape (N, n_names).

        Raises:
            RecordError: the record lacks one of them.
        """
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise MissingColumnsError(self.path, missing, self.columns)
        if not names:
            return np.empty((len(self.time), 0))
        return np.stack([self.columns[name] for name in names], axis=1)

    def place(self, sample: int) -> str:
        """Write the place of a sample for messages: number from 1, line in a text file, time."""
        line = f"line {self.first_line + sample}, " if self.first_line else ""
        return f"sample {sample + 1} ({line}t = {self.time[sample]:.6g} s)"

    def with_unit(self, name: str, value: float) -> str:
        """Write a value of a column with its unit, if it has one."""
        return f"{value:.6g} {self.units[name]}".rstrip()
