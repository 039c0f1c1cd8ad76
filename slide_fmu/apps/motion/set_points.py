"""Set points are written as CSV: inputs at the step of the FMU, or curves at another rate.

Motion controllers want positions, speeds and accelerations of their own rate. The curve passes
all samples, for which the move was planned. It may exceed limits between them, and says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from slide_fmu.apps.motion.coordinates import Coordinate, inputs_of
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.core.files import write_whole
from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate

DEGREE = 5
"""Degree of the curve: speed and acceleration are smooth, and zero at both ends."""

MOST_ROWS = 1_000_000
"""Largest number of rows of a file."""

EXCESS = 0.03
"""A curve that exceeds a limit by more than this fraction gets a remark."""


@dataclass(frozen=True, eq=False)
class MotionCurve:
    """A MotionCurve passes samples of coordinates, from rest to rest.

    It begins a step before the first sample and ends a step after the last one, since a motion may
    start with its full acceleration.

    Attributes:
        coordinates: the coordinates.
        samples: their values, (N, n_coordinates), at rest at both ends.
        step: time between samples, in s.
        limits: limits of the samples.
    """

    coordinates: tuple[Coordinate, ...]
    samples: FloatArray
    step: float
    limits: Limits

    @property
    def duration(self) -> float:
        """The time in s at which it rests; it begins at 0."""
        return self.step * (len(self.samples) + 1)

    @cached_property
    def spline(self) -> BSpline:
        """The positions by the time in s."""
        rows = np.concatenate([self.samples[:1], self.samples, self.samples[-1:]])
        still = np.zeros(rows.shape[1])
        rest = [(1, still), (2, still)]
        time = self.step * np.arange(len(rows))
        return make_interp_spline(time, rows, k=DEGREE, bc_type=(rest, rest))

    def remark(self, rows: FloatArray) -> str | None:
        """Say how far rows of speeds and accelerations, (N, 2, n_coordinates), exceed limits."""
        beyond = [
            f"the {name} reaches {percent(used)} of its limit"
            for column, (name, _, limit) in enumerate(list(self.limits.derivatives())[:2])
            if (used := float((np.abs(rows[:, column]) / limit).max())) > 1 + EXCESS
        ]
        if not beyond:
            return None
        return (
            f"Between the samples of set_points.csv, {' and '.join(beyond)}: lower this limit in "
            "the task, or add a limit of the jerk."
        )


def write_curve(surrogate: Surrogate, curve: MotionCurve, rate: float, path: Path) -> str | None:
    """Write position, speed and acceleration of each coordinate as CSV; return a remark.

    It says what one should know, and is None if there is nothing.

    Args:
        surrogate: the surrogate, whose inputs move between samples.
        curve: the curve.
        rate: time between rows, in s; the last one is at rest.
        path: the file.

    Raises:
        MotionError: inputs hold over each step, or there are too many rows or fewer than two.
    """
    if surrogate.hold == "zero_order":
        raise MotionError(
            f"--rate {rate:g} for surrogate {surrogate.name!r}, whose inputs hold over each step; "
            "expected one whose inputs move between samples: leave --rate away"
        )
    if not 0 < rate <= curve.duration:
        raise MotionError(
            f"--rate {rate:g} is no time between rows in s of this motion, which takes "
            f"{curve.duration:.4g} s; expected one above 0 and at most as long: lower it, such as "
            f"to {curve.step / 10:g}"
        )
    count = math.ceil(curve.duration / rate - 1e-9) + 1
    if count > MOST_ROWS:
        raise MotionError(
            f"--rate {rate:g} gives {count} rows; expected at most {MOST_ROWS}: raise it"
        )
    time = rate * np.arange(count)
    at = np.minimum(time, curve.duration)
    rows = np.stack([curve.spline(at, nu=order) for order in range(3)], axis=1)
    rows[[0, -1], 1:] = 0.0  # rounding
    names = [
        name + of
        for name in (c.title.replace(" ", "_") for c in curve.coordinates)
        for of in ("", "_speed", "_acceleration")
    ]
    columns = rows.transpose(0, 2, 1).reshape(count, -1)
    _write(names, np.concatenate([time[:, None], columns], axis=1), path)
    return curve.remark(rows[:, 1:])


def write_inputs(
    surrogate: Surrogate, coordinates: tuple[Coordinate, ...], motion: FloatArray, path: Path
) -> None:
    """Write the inputs of a motion, (N, n_coordinates), as CSV, with times in s from 0 on."""
    time = surrogate.window.step * np.arange(len(motion))
    rows = np.concatenate([time[:, None], inputs_of(coordinates, motion)], axis=1)
    _write([signal.name for signal in surrogate.inputs], rows, path)


def _write(names: list[str], rows: FloatArray, path: Path) -> None:
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows]
    write_whole(path, ("\n".join([",".join(["time", *names]), *lines]) + "\n").encode())
