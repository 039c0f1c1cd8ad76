"""Rows of a coupled run are kept as steps are accepted: none is lost where it stops."""

from __future__ import annotations

import itertools
import os
import struct
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, final

import numpy as np

from slide_fmu.core.signals import FloatArray

REAL = struct.Struct("d")


class Rows(NamedTuple):
    """Rows have values at communication points.

    Attributes:
        time: in s, (N,).
        outputs, inputs, watched: outputs, linked inputs and watched variables there, (N, n) each.
    """

    time: FloatArray
    outputs: FloatArray
    inputs: FloatArray
    watched: FloatArray


@final
class RowKeeper:
    """A RowKeeper keeps rows in memory, and in a file where a program of its own runs the FMUs.

    Args:
        path: the file, which is written row by row: what an FMU ends at once is there.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._file = None if path is None else os.open(path, os.O_RDWR | os.O_CREAT)
        self.clear()

    def clear(self) -> None:
        """Forget all rows, for a run that begins anew."""
        self.times: list[float] = []
        self.outputs: list[FloatArray] = []
        self.inputs: list[FloatArray] = []
        self.watched: list[Sequence[float]] = []
        if self._file is not None:
            os.ftruncate(self._file, 0)
            os.lseek(self._file, 0, os.SEEK_SET)

    def add(
        self, time: float, outputs: FloatArray, inputs: FloatArray, watched: Sequence[float]
    ) -> None:
        """Add the row of a communication point; time in s."""
        self.times.append(time)
        self.outputs.append(outputs)
        self.inputs.append(inputs)
        self.watched.append(watched)
        if self._file is not None:
            row = REAL.pack(time) + outputs.tobytes() + inputs.tobytes()
            os.write(self._file, row + array("d", watched).tobytes() if watched else row)

    def cut(self, count: int) -> None:
        """Forget all rows but the first ones."""
        for values in (self.times, self.outputs, self.inputs, self.watched):
            del values[count:]

    def rows(self, last: int = 0) -> Rows:
        """Return all rows, or some of the last ones."""
        count = len(self.times[-last:])
        tables = (self.outputs, self.inputs, self.watched)
        return Rows(
            np.array(self.times[-last:]),
            *(np.array(each[-last:], dtype=np.float64).reshape(count, -1) for each in tables),
        )


def read_rows(path: Path, widths: tuple[int, int, int]) -> Rows:
    """Read the rows of a run whose program has ended; a row that is not whole is left out.

    ``widths`` are the numbers of outputs, linked inputs and watched variables.
    """
    data = np.fromfile(path) if path.exists() else np.empty(0)
    width = 1 + sum(widths)
    table = data[: len(data) // width * width].reshape(-1, width)
    ends = np.cumsum((1, *widths))
    outputs, inputs, watched = (table[:, a:b] for a, b in itertools.pairwise(ends))
    return Rows(table[:, 0], outputs, inputs, watched)
