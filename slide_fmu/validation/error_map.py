"""This module measures the error by amplitude and frequency of the inputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import TINY, size_about
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation

SHORTEST_PIECE = 16
"""Fewest samples of a piece: shorter ones have no frequency."""

AMPLITUDES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
"""Edges of the rows, as parts of half the range of an input; the last row is open."""

MOST_COLUMNS = 7
"""Largest number of columns."""

SLOWEST = 0.01
"""The first column is open: it holds this part of the pieces."""


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """An ErrorMap has the error for each amplitude and each frequency of the inputs.

    Attributes:
        seconds: length of a piece in s.
        amplitudes: lower edges of the rows, parts of half the range, (rows,).
        frequencies: edges between the columns in Hz, (columns - 1,).
        error: relative RMSE of the worst output, (rows, columns); NaN without a piece.
        pieces: number of the pieces, (rows, columns).
    """

    seconds: float
    amplitudes: FloatArray
    frequencies: FloatArray
    error: FloatArray
    pieces: NDArray[np.intp]


def error_map(validation: Validation) -> ErrorMap | None:
    """Cut all trajectories into pieces, and sort them by amplitude and frequency of the inputs.

    A piece is as long as the memory of the surrogate. Its amplitude is half the distance between
    the largest and the smallest value, of the input that moves most over its range. Its frequency
    is the one that a sine has whose differences from sample to sample are as large. The error is
    relative to the RMS of the reference about its mean over all trajectories. The result is None
    where trajectories are too short, or where all inputs are constant.
    """
    surrogate, step = validation.surrogate, validation.surrogate.window.step
    shortest = min(len(c.time) for c in validation.used)
    length = min(max(surrogate.network.memory_length, SHORTEST_PIECE), shortest)
    if length < SHORTEST_PIECE:
        return None
    reference = np.concatenate([c.reference for c in validation.used])
    size = size_about(reference, validation.mean)
    pieces_of = [_pieces_of(c, length, surrogate.inputs, size) for c in validation.used]
    amplitude, cycles, square = (np.concatenate(part) for part in zip(*pieces_of, strict=True))
    moving = amplitude > 0
    if not moving.any():
        return None
    frequency, amplitude, square = cycles[moving] / step, amplitude[moving], square[moving]
    edges = _edges(frequency)
    amplitudes = np.array(AMPLITUDES[:-1] if amplitude.max() <= 1 + 1e-9 else AMPLITUDES)
    row = np.searchsorted(amplitudes, amplitude, side="right") - 1
    column = np.searchsorted(edges, frequency, side="right")
    shape = len(amplitudes), len(edges) + 1
    error, pieces = np.full(shape, np.nan), np.zeros(shape, dtype=np.intp)
    for place in np.ndindex(shape):
        inside = (row == place[0]) & (column == place[1])
        pieces[place] = np.count_nonzero(inside)
        if pieces[place]:
            error[place] = np.sqrt(square[inside].mean(axis=0)).max()
    return ErrorMap(step * length, amplitudes, edges, error, pieces)


def _pieces_of(
    comparison: Comparison, length: int, inputs: tuple[Signal, ...], size: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return amplitude, cycles in a sample, and mean squared relative error of each piece."""
    half = np.array([0.5 * (signal.high - signal.low) for signal in inputs])
    count = len(comparison.time) // length
    driven, error = (
        values[: count * length].reshape(count, length, -1)
        for values in (comparison.inputs / half, comparison.error / size)
    )
    swings = 0.5 * np.ptp(driven, axis=1)
    leading = np.argmax(swings, axis=1)
    course = driven[np.arange(count), :, leading]
    change = np.sqrt(np.mean(np.diff(course, axis=1) ** 2, axis=1))
    spread = np.sqrt(np.mean((course - course.mean(axis=1, keepdims=True)) ** 2, axis=1))
    sine = np.minimum(change / np.maximum(2 * spread, TINY), 1.0)
    return swings.max(axis=1), np.arcsin(sine) / np.pi, np.mean(error**2, axis=1)


def _edges(frequency: FloatArray) -> FloatArray:
    """Return round edges between columns: 1, 2 and 5, or powers of ten where these are many."""
    low, high = float(np.quantile(frequency, SLOWEST)), float(frequency.max())
    powers = range(int(np.floor(np.log10(max(low, TINY)))), int(np.ceil(np.log10(high))) + 1)
    for parts in ((1, 2, 5), (1, 3), (1,)):
        every = [part * 10.0**power for power in powers for part in parts]
        kept = np.array([edge for edge in every if low < edge < high])
        if len(kept) < MOST_COLUMNS:
            break
    return kept
