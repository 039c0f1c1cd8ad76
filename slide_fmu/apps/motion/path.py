"""A path comes from a file of samples, and is interpolated at the surrogate's step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.apps.motion.coordinates import Coordinate
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.reading import read_record
from slide_fmu.record_files.record import Record, RecordError
from slide_fmu.surrogate.surrogate import Surrogate

LEAST_SAMPLES = 4
"""Smallest number of samples of a path, so that corrections can be cubic splines."""

MOST_SAMPLES = 1200
"""Largest number of samples of a path: memory grows with the square."""


ON_CIRCLE = 0.05
"""Tolerance of the radius of cosine and sine of an angle, relative to it: they are rounded."""


@dataclass(frozen=True, eq=False)
class Path:
    """A Path has samples at the step of a surrogate.

    Attributes:
        motion: coordinates, (count, n_coordinates).
        wished: wished outputs, (count, n_outputs); None if the file has none.
    """

    motion: FloatArray
    wished: FloatArray | None


def read_path(name: str, coordinates: tuple[Coordinate, ...], surrogate: Surrogate) -> Path:
    """Read a path from a CSV, Parquet, HDF5 or MAT file; between samples are cubic splines.

    An angle has columns for its cosine and its sine, like set points.

    Raises:
        MotionError: the file cannot be read, lacks a column of an input, has only some of the
            outputs, has values that are not numbers, has times that do not rise, has too few or
            too many samples, or has columns that are not cosine and sine of an angle.
    """
    inputs, outputs = ([s.name for s in of] for of in (surrogate.inputs, surrogate.outputs))
    step = surrogate.window.step
    try:
        record = read_record(name, inputs, others=True)
    except RecordError as error:
        raise MotionError(str(error).replace("next to the recipe", "next to the task")) from error
    time = record.time
    if not np.all(np.diff(time) > 0):
        sample = int(np.argmax(np.diff(time) <= 0)) + 1
        raise MotionError(
            f"{name}: the time {time[sample]:g} s of sample {sample} comes after "
            f"{time[sample - 1]:g} s; expected times that rise: correct the file"
        )
    found = [output for output in outputs if output in record.columns]
    if found and len(found) < len(outputs):
        raise MotionError(
            f"{name} has columns for {found}; expected one for each of the outputs {outputs}, or "
            "for none: add the others"
        )
    count = int((time[-1] - time[0]) / step + 0.5) + 1
    if not LEAST_SAMPLES <= count <= MOST_SAMPLES:
        raise MotionError(
            f"{name} takes {time[-1] - time[0]:g} s, which are {count} samples of {step:g} s; "
            f"expected {LEAST_SAMPLES} to {MOST_SAMPLES}: correct the times, or divide the path"
        )
    at = time[0] + step * np.arange(count)
    later = (
        step if surrogate.hold == "zero_order" else 0.0
    )  # their outputs belong to the end of a step
    wished = _sampled(record, found, at + later) if found else None
    motion = _coordinates(_sampled(record, inputs, at), coordinates)
    _require_circles(record, inputs, coordinates)
    return Path(motion, wished)


def _require_circles(
    record: Record, inputs: list[str], coordinates: tuple[Coordinate, ...]
) -> None:
    """Refuse columns of an angle that are not its cosine and sine, times the radius."""
    names = iter(inputs)
    for coordinate in coordinates:
        cosine = next(names)
        if coordinate.radius is None:
            continue
        sine = next(names)
        found = np.hypot(record.columns[cosine], record.columns[sine])
        away = np.abs(found - coordinate.radius)
        if away.max() > ON_CIRCLE * coordinate.radius:
            sample = int(np.argmax(away))
            raise MotionError(
                f"{record.path}: {cosine!r} and {sine!r} in sample {sample} lie "
                f"{found[sample]:.4g} from 0; expected cosine and sine of an angle, "
                f"{coordinate.radius:.4g} from 0: correct the columns"
            )


def _coordinates(inputs: FloatArray, coordinates: tuple[Coordinate, ...]) -> FloatArray:
    """Turn inputs, (N, n_inputs), into coordinates, (N, n_coordinates)."""
    columns, found = iter(inputs.T), []
    for coordinate in coordinates:
        values = next(columns)
        if coordinate.radius is not None:
            values = np.unwrap(np.arctan2(next(columns), values))
        found.append(values)
    return np.stack(found, axis=1)


def _sampled(record: Record, names: list[str], at: FloatArray) -> FloatArray:
    """Interpolate columns at times in s, (N,): shape (N, n_names); the end values hold."""
    values = np.stack([record.columns[name] for name in names], axis=1)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise MotionError(
            f"{record.path}: {names[column]!r} in sample {row} is no number; expected numbers "
            "throughout: correct the file"
        )
    within = np.clip(at, record.time[0], record.time[-1])
    return np.asarray(CubicSpline(record.time, values, bc_type="natural")(within))
