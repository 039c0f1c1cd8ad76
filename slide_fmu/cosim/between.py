"""Inputs are interpolated between the times at which they are known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray

CLEARLY_BETTER = 0.25
"""A curve is used if its mean square error is below this fraction of a straight line's."""

AROUND = 3
"""Number of known values on either side whose errors decide between curve and line."""

SLACK = 1e-6
"""Relative rounding error of distances in time, in steps."""


def refine(
    times: FloatArray, values: FloatArray, cosines: tuple[int, ...], step: float
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Divide distances longer than a step into equal parts, and interpolate the inputs there.

    A smooth input is a cubic through the four values around; any other is a straight line. An
    input is smooth where cubics through the neighbours of known values predict them far better
    than straight lines. For an angle, its turn is interpolated this way, and its length is a
    straight line.

    Args:
        times: in s, rising, shape (N,).
        values: inputs at these times, shape (N, n_inputs).
        cosines: indices of inputs that are the cosine of an angle, whose sine is the next.
        step: longest distance in s.

    Returns:
        Times, inputs at these times, and the places of the given times among them, shape (N,).
    """
    counts = np.maximum(np.ceil(np.diff(times) / step - SLACK), 1).astype(np.int64)
    places = np.concatenate([[0], np.cumsum(counts)])
    if len(times) == 0 or places[-1] == len(times) - 1:
        return times, values, places
    of = np.repeat(np.arange(len(counts)), counts)  # the interval of every time but the last
    part = (np.arange(len(of)) - places[of]) / counts[of]
    at = np.append(times[of] + part * np.diff(times)[of], times[-1])
    columns = [_column(times, column, at, of) for column in values.T]
    for i in cosines:
        angle = np.unwrap(np.arctan2(values[:, i + 1], values[:, i]))
        length = np.interp(at, times, np.hypot(values[:, i], values[:, i + 1]))
        turned = _column(times, angle, at, of)
        columns[i], columns[i + 1] = length * np.cos(turned), length * np.sin(turned)
    inputs = np.stack(columns, axis=1)
    inputs[places] = values
    return at, inputs, places


def interpolated(
    times: FloatArray,
    values: FloatArray,
    cosines: tuple[int, ...],
    at: FloatArray,
    curved: bool,
) -> FloatArray:
    """Interpolate inputs at any times: along straight lines, or as ``refine`` where ``curved``.

    An angle turns evenly, or as the curve does, and its length is a straight line. Before the
    first and after the last time the inputs are constant.

    Args:
        times: in s, rising, shape (N,), N >= 2.
        values: inputs at these times, shape (N, n_inputs).
        cosines: indices of inputs that are the cosine of an angle, whose sine is the next.
        at: times in s at which the inputs are wanted, shape (M,).
        curved: whether smooth inputs are cubics between the times.
    """
    at = np.clip(at, times[0], times[-1])
    of = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)

    def column(course: FloatArray) -> FloatArray:
        if not curved:
            return np.interp(at, times, course)
        return _column(times, course, np.append(at, times[-1]), of)[:-1]

    columns = [column(course) for course in values.T]
    for i in cosines:
        turned = column(np.unwrap(np.arctan2(values[:, i + 1], values[:, i])))
        length = np.interp(at, times, np.hypot(values[:, i], values[:, i + 1]))
        columns[i], columns[i + 1] = length * np.cos(turned), length * np.sin(turned)
    return np.stack(columns, axis=1)


def even_out(
    times: FloatArray, values: FloatArray, cosines: tuple[int, ...], step: float
) -> FloatArray:
    """Move values of smooth inputs so that straight lines through them have the mean of the curve.

    Straight lines of one step, between values of a curve u, differ from it by step^2 u'' / 12 in
    the mean; the values are moved by this. Inputs that are not smooth stay unchanged. For an
    angle, the turn is moved.

    Args:
        times: in s, rising, shape (N,).
        values: inputs at these times, shape (N, n_inputs).
        cosines: indices of inputs that are the cosine of an angle, whose sine is the next.
        step: length of the straight lines in s.
    """
    columns = [column - _sag(times, column, step) for column in values.T]
    for i in cosines:
        angle = np.unwrap(np.arctan2(values[:, i + 1], values[:, i]))
        length, turned = np.hypot(values[:, i], values[:, i + 1]), angle - _sag(times, angle, step)
        columns[i], columns[i + 1] = length * np.cos(turned), length * np.sin(turned)
    return np.stack(columns, axis=1)


def _sag(times: FloatArray, values: FloatArray, step: float) -> FloatArray:
    """Return the mean distance of lines of one step from the curve, where it is smooth."""
    sags, smooth = np.zeros(len(times)), _is_smooth(times, values)
    if len(times) > 2:
        slopes = np.diff(values) / np.diff(times)
        curvature = 2 * np.diff(slopes) / (times[2:] - times[:-2])
        sags[1:-1] = np.where(smooth[1:] & smooth[:-1], step**2 / 12 * curvature, 0.0)
    return sags


def _column(
    times: FloatArray, values: FloatArray, at: FloatArray, of: NDArray[np.int64]
) -> FloatArray:
    """Interpolate one input or angle at times; all but the last lie in the intervals ``of``."""
    course = np.interp(at, times, values)
    first = np.clip(of - 1, 0, max(len(times) - 4, 0))
    curved = _is_smooth(times, values)[of]
    nodes = first[curved, None] + np.arange(4)
    course[:-1][curved] = _cubic(times[nodes], values[nodes], at[:-1][curved])
    return course


def _is_smooth(times: FloatArray, values: FloatArray) -> NDArray[np.bool_]:
    """Return for each interval, (N - 1,), whether cubics predict the values around it better.

    Every value is predicted from its neighbours: from two of them, or from four.
    """
    count = len(times) - 4
    if count < 2 * AROUND:
        return np.zeros(len(times) - 1, dtype=bool)
    nodes = np.arange(count)[:, None] + np.array([0, 1, 3, 4])
    middle, true = times[2:-2], values[2:-2]
    by_cubic = _cubic(times[nodes], values[nodes], middle)
    before, after = times[1:-3], times[3:-1]
    share = (middle - before) / (after - before)
    by_line = values[1:-3] + share * (values[3:-1] - values[1:-3])
    window = np.ones(2 * AROUND)
    cubic, line = (np.convolve((f - true) ** 2, window, "valid") for f in (by_cubic, by_line))
    # sum j is over the values j + 2 .. j + 1 + 2 AROUND, around the interval j + 1 + AROUND
    places = np.clip(np.arange(len(times) - 1) - 1 - AROUND, 0, len(line) - 1)
    return np.asarray(cubic < CLEARLY_BETTER * line)[places]


def _cubic(nodes: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Evaluate cubics through four points each, (M, 4), at one time each, (M,)."""
    sums = np.zeros(len(at))
    for i in range(4):
        weight = np.ones(len(at))
        for j in range(4):
            if j != i:
                weight = weight * (at - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
        sums += weight * values[:, i]
    return sums
