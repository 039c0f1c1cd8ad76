"""Set points are written as CSV: inputs at the step of the FMU, or curves at another rate.

Motion controllers want positions, speeds and accelerations of their own rate. A move becomes the
cubic B-spline whose control points are its samples: it keeps every limit of the samples, since its
derivatives are means of their differences. A spline through the samples would not: a move that
starts with full acceleration makes it overshoot. A path must be followed, so it is interpolated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
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

DEGREE = 3
"""Degree of the curve of a move: accelerations are continuous."""

MOST_ROWS = 1_000_000
"""Largest number of rows of a file."""

EXCESS = 0.03
"""A curve that exceeds a limit by more than this fraction gets a remark."""


@dataclass(frozen=True, eq=False)
class MotionCurve:
    """A MotionCurve leads from rest to rest between samples of coordinates.

    Attributes:
        coordinates: the coordinates.
        spline: their positions by the time in s.
        duration: time in s at which it rests; it begins at 0.
        limits: limits of its samples.
        away: largest distance from the samples, (n_coordinates,).
    """

    coordinates: tuple[Coordinate, ...]
    spline: BSpline
    duration: float
    limits: Limits
    away: FloatArray

    def remark(self, rows: FloatArray) -> str | None:
        """Say how far rows of speeds and accelerations, (N, 2, n_coordinates), exceed limits."""
        sentences = [
            f"Between the samples, the {name} reaches {percent(used)} of its limit."
            for column, (name, _, limit) in enumerate(list(self.limits.derivatives())[:2])
            if (used := float((np.abs(rows[:, column]) / limit).max())) > 1 + EXCESS
        ]
        if self.away.any():
            worst = int(np.argmax(self.away))
            sentences.append(
                f"The curve rounds the samples by up to {self.away[worst]:.2g} "
                f"{self.coordinates[worst].unit}, and takes two samples longer."
            )
        return " ".join(sentences) or None


def curve_of_move(
    coordinates: tuple[Coordinate, ...], samples: FloatArray, step: float, limits: Limits
) -> MotionCurve:
    """Return the curve of a move, (N, n_coordinates), from its last sample of rest on."""
    before, after = (np.repeat(samples[[at]], DEGREE - 1, axis=0) for at in (0, -1))
    control = np.concatenate([before, samples, after])
    knots = step * (np.arange(len(control) + DEGREE + 1) - DEGREE)
    # each sample has its largest weight one step after its time, so that rest lasts until 0
    spline, time = BSpline(knots, control, DEGREE), step * np.arange(len(samples))
    away = np.abs(spline(time + step) - samples).max(axis=0)
    return MotionCurve(coordinates, spline, step * (len(samples) + 1), limits, away)


def curve_of_path(
    coordinates: tuple[Coordinate, ...], samples: FloatArray, step: float, limits: Limits
) -> MotionCurve:
    """Return the curve through the samples of a path, (N, n_coordinates), at rest at its ends."""
    time, still = step * np.arange(len(samples)), np.zeros(samples.shape[1])
    rest = [(1, still), (2, still)]
    spline = make_interp_spline(time, samples, k=5, bc_type=(rest, rest))
    return MotionCurve(coordinates, spline, float(time[-1]), limits, still)


def write_curve(surrogate: Surrogate, curve: MotionCurve, rate: float, path: Path) -> str | None:
    """Write position, speed and acceleration of each coordinate as CSV; return a remark.

    It says what one should know, and is None if there is nothing.

    Args:
        surrogate: the surrogate, whose inputs move between samples.
        curve: the curve.
        rate: time between rows, in s; the last one is at rest.
        path: the file.

    Raises:
        MotionError: inputs hold over each step, or there are too many rows.
    """
    if surrogate.hold == "zero_order":
        raise MotionError(
            f"--rate {rate:g} for surrogate {surrogate.name!r}, whose inputs hold over each step; "
            "expected one whose inputs move between samples: leave --rate away"
        )
    count = math.ceil(curve.duration / rate - 1e-9) + 1
    if count > MOST_ROWS:
        raise MotionError(
            f"--rate {rate:g} gives {count} rows; expected at most {MOST_ROWS}: raise it"
        )
    time = rate * np.arange(count)
    at = np.minimum(time, curve.duration)
    rows = np.stack([curve.spline(at, nu=order) for order in range(3)], axis=1)
    rows[-1, 1:] = 0.0  # rounding
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
