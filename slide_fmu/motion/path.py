"""A path comes from a file of samples, and is evaluated at the surrogate's step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.motion.coordinates import Coordinate
from slide_fmu.motion.records import MotionError
from slide_fmu.systems.record.measured import Record, RecordError
from slide_fmu.systems.record.reading import read_record


@dataclass(frozen=True, eq=False)
class Path:
    """A Path has samples at the step of a surrogate.

    Attributes:
        motion: coordinates, (count, n_coordinates).
        wished: outputs, (count, n_outputs); None where the file has none.
    """

    motion: FloatArray
    wished: FloatArray | None


def read_path(
    name: str, coordinates: tuple[Coordinate, ...], outputs: tuple[Signal, ...], step: float
) -> Path:
    """Read a path from a CSV, Parquet, HDF5 or MAT file; cubic splines lie between its samples.

    Raises:
        MotionError: the file cannot be read, lacks a coordinate, has some of the outputs only,
            holds something that is no number, or has times that do not rise.
    """
    try:
        record = read_record(name, [c.name for c in coordinates], others=True)
    except RecordError as error:
        raise MotionError(str(error)) from error
    time = record.time
    if not np.all(np.diff(time) > 0):
        sample = int(np.argmax(np.diff(time) <= 0)) + 1
        raise MotionError(
            f"{name}: the time {time[sample]:g} s of sample {sample} comes after "
            f"{time[sample - 1]:g} s; expected times that rise: correct the file"
        )
    found = [output.name for output in outputs if output.name in record.columns]
    if found and len(found) < len(outputs):
        raise MotionError(
            f"{name} has columns for {found}; expected one for each of the outputs "
            f"{[output.name for output in outputs]}, or for none: add the others"
        )
    at = np.arange(time[0], time[-1] + 0.5 * step, step)
    at = np.minimum(at, time[-1])
    motion = _sampled(record, [c.name for c in coordinates], at)
    return Path(motion, _sampled(record, found, at) if found else None)


def _sampled(record: Record, names: list[str], at: FloatArray) -> FloatArray:
    """Evaluate columns at times in s, (N,): shape (N, n_names)."""
    values = np.stack([record.columns[name] for name in names], axis=1)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise MotionError(
            f"{record.path}: {names[column]!r} in sample {row} is no number; expected numbers "
            "throughout: correct the file"
        )
    return np.asarray(CubicSpline(record.time, values, bc_type="natural")(at))
