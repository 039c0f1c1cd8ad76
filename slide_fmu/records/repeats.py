"""This module finds repeated inputs, such as periods of a multisine or a repeated drive signal.

An error that is measured on inputs which were learnt from says little about other inputs. Samples
whose inputs are the same, up to noise, get the same number here, wherever they are in the records,
and the division of records keeps samples of one number in one part.

Method: the autocorrelation of all records, laid end to end, has peaks at the lags of repetitions.
At each of these lags the inputs are compared window by window.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import find_peaks
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from slide_fmu.core.signals import FloatArray

ALIKE = 0.02
"""Inputs are alike if the power of their difference is at most this part of their own power.

Noise of a tenth of a recorded input (20 dB) reaches this value.
"""

MOVES = 0.05
"""Inputs at rest are no repetition: a window has at least this part of the mean power."""

WINDOW = 30
"""Length of a compared window in correlation times; inputs of shorter ones agree by chance."""

TONE = 10
"""Inputs must stay uncorrelated for this multiple of the correlation time, as a tone does not."""

LEAST = 0.05
"""Inputs repeat if at least this part of all samples repeats at one lag."""

CYCLES = 0.5
"""Inputs are cycles of a tone if at least this part of all samples repeats one cycle later."""

LAGS = 30
"""Number of examined lags, the ones with the strongest correlation."""


def same_inputs(inputs: Sequence[FloatArray]) -> NDArray[np.intp]:
    """Number the samples of records, (N, n_inputs) each; equal inputs share a number.

    Inputs are the same if all of them agree at once, up to noise. Samples at rest, and inputs that
    are not finite, are different from all others.

    Returns:
        Numbers of all samples, records laid end to end, shape (sum of N,). They rise from 0 in the
        order in which inputs first come.
    """
    scaled = _standardized(np.concatenate(inputs))
    records = np.repeat(np.arange(len(inputs)), [len(one) for one in inputs])
    numbers = np.arange(len(scaled))
    for lag, comes_again in _repetitions(scaled, records):
        before = np.flatnonzero(comes_again)
        first, second = numbers[before], numbers[before + lag]
        if (first != second).any():
            numbers = connected(first, second, int(numbers.max()) + 1)[numbers]
    return numbers


def connected(first: NDArray[np.intp], second: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Number ``count`` things: pairs of them, shape (pairs,) each, and pairs of pairs, share one.

    Returns:
        Numbers that rise from 0 in the order in which they first come, shape (count,).
    """
    pairs = coo_array((np.ones(len(first), bool), (first, second)), shape=(count, count))
    return in_order(connected_components(pairs, directed=False)[1])


def in_order(numbers: NDArray[np.integer]) -> NDArray[np.intp]:
    """Replace numbers, shape (N,), by others that rise from 0 in the order they first come."""
    _, first, inverse = np.unique(numbers, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[inverse])


def _standardized(inputs: FloatArray) -> FloatArray:
    """Scale inputs, (N, n_inputs), to mean 0 and deviation 1; leave out those that never move.

    Values that are not finite count as the mean.
    """
    kept = np.where(np.isfinite(inputs), inputs, np.nan)
    kept = kept[:, [bool(np.isfinite(c).any() and np.nanmax(c) > np.nanmin(c)) for c in kept.T]]
    centred = np.nan_to_num(kept - np.nanmean(kept, axis=0)) if kept.size else kept
    return np.asarray(centred / centred.std(axis=0)) if kept.size else centred


def _repetitions(
    scaled: FloatArray, records: NDArray[np.intp]
) -> Iterator[tuple[int, NDArray[np.bool_]]]:
    """Find lags, and for each the samples, shape (N - lag,), that repeat after this lag.

    Args:
        scaled: standardized inputs, shape (N, n_inputs).
        records: number of the record of each sample, shape (N,).
    """
    correlation = _autocorrelation(scaled)
    alike = np.flatnonzero(correlation >= 0.5)
    if not len(alike):
        return
    ends = alike + 1
    is_lasting = np.append(alike[1:], TONE * len(scaled) + TONE) > TONE * ends
    width = WINDOW * int(ends[is_lasting][0])
    if 2 * width > len(scaled):
        yield from _whole_cycles(scaled, records, correlation)
        return
    peaks, _ = find_peaks(np.append(correlation, 0.0), height=LEAST, distance=width // 2)
    peaks = peaks[peaks >= width]
    strongest = peaks[np.argsort(correlation[peaks])[::-1]][:LAGS]
    for lag in np.sort(strongest).tolist():
        comes_again = _alike(scaled, records, lag, width)
        if np.count_nonzero(comes_again) >= LEAST * len(scaled):
            yield lag, comes_again


def _whole_cycles(
    scaled: FloatArray, records: NDArray[np.intp], correlation: FloatArray
) -> Iterator[tuple[int, NDArray[np.bool_]]]:
    """Find the cycle of tones and square waves, of which a window can be as long as one cycle."""
    for lag in find_peaks(correlation, height=0.5)[0][:LAGS].tolist():
        comes_again = _alike(scaled, records, lag, lag)
        if np.count_nonzero(comes_again) >= CYCLES * len(scaled):
            yield lag, comes_again
            return


def _autocorrelation(scaled: FloatArray) -> FloatArray:
    """Compute the autocorrelation of inputs, shape (N,), relative to their power."""
    length = len(scaled)
    size = next_fast_len(2 * length, real=True)
    products = np.zeros(length)
    for channel in scaled.T:
        products += irfft(np.abs(rfft(channel, size)) ** 2, size)[:length]
    return np.asarray(products / max(products[0], 1e-300)) if length else products


def _alike(
    scaled: FloatArray, records: NDArray[np.intp], lag: int, width: int
) -> NDArray[np.bool_]:
    """Tell which samples lie in a window of a record that repeats a lag later, (N - lag,)."""
    length = len(scaled) - lag
    if length < width:
        return np.zeros(length, bool)
    off = _sums(np.sum((scaled[lag:] - scaled[:-lag]) ** 2, axis=1), width)
    power = np.sum([_variances(channel, width) for channel in scaled.T], axis=0)
    power = np.minimum(power[:-lag], power[lag:])
    is_whole = records[: len(power) + lag] == records[width - 1 :]
    is_whole = is_whole[:-lag] & is_whole[lag:]
    moves = power > MOVES * width * scaled.shape[1]
    begins = np.flatnonzero((off <= ALIKE * power) & moves & is_whole)
    marks = np.zeros(length + 1)
    np.add.at(marks, begins, 1.0)
    np.add.at(marks, begins + width, -1.0)
    return np.asarray(np.cumsum(marks)[:length] > 0.5)


def _sums(values: FloatArray, width: int) -> FloatArray:
    """Compute the sums over all windows, (N,) to (N - width + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[width:] - total[:-width])


def _variances(values: FloatArray, width: int) -> FloatArray:
    """Compute the sums of squares about the mean of all windows."""
    return _sums(values**2, width) - _sums(values, width) ** 2 / width
