"""Inputs that repeat a period: then what is learnt from and what is tested may be the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from slide_fmu.core.signals import FloatArray

ALIKE = 0.02
"""Two periods are alike if the power of their difference is at most this part of their own power.

Noise of a tenth of a recorded input (20 dB) makes as much.
"""

SHARE = 0.5
"""Inputs repeat if at least this part of the record lies in periods that are alike."""

WEAKEST = 0.2
"""The correlation at a period is at least this, where only parts of the record repeat."""

MOVES = 0.05
"""In a period an input has at least this part of the power that it has in the whole record."""


@dataclass(frozen=True)
class Period:
    """A Period is what inputs repeat.

    Attributes:
        samples: its length.
        share: part of the record that lies in periods which are like the one before or behind.
    """

    samples: int
    share: float


def find_period(inputs: FloatArray) -> Period | None:
    """Find the shortest period that inputs, shape (N, n_inputs), repeat, exactly or up to noise.

    All inputs repeat it together. At least two periods lie in the record; where only parts of it
    repeat, as with several periods that come twice each, these are at least half of it.
    """
    scaled = standardized(inputs)
    length = len(scaled)
    if length < 4 or not scaled.shape[1]:
        return None
    alike = _autocorrelation(scaled)[: length // 2 + 1]
    apart = np.flatnonzero(alike < 0.5)
    if not len(apart):
        return None
    first = int(apart[0])  # before, inputs are only like themselves
    if first + 1 >= len(alike):
        return None
    best = float(alike[first:].max())
    if best < WEAKEST:
        return None
    slack = 1 - best + 1e-4 if best >= 1 - ALIKE / 2 else 0.1 * best
    inside = np.flatnonzero(_is_peak(alike)[first:] & (alike[first:] >= best - slack))
    for lag in inside[:3]:
        period = first + int(lag)
        share = float(_repeated(scaled, period).mean())
        if share >= SHARE:
            return Period(period, share)
    return None


def groups_of_periods(inputs: FloatArray, period: int) -> NDArray[np.intp]:
    """Number the whole periods of inputs, (N, n_inputs): those that are alike have one number.

    They are compared wherever they begin, so that a period which was cut elsewhere is known again.
    Shape (N // period,); numbers rise in the order in which periods first come.
    """
    scaled = standardized(inputs)
    count = len(scaled) // period
    periods = scaled[: count * period].reshape(count, period, scaled.shape[1])
    known: list[FloatArray] = []
    numbers = np.empty(count, np.intp)
    for index, one in enumerate(periods):
        same = [k for k, other in enumerate(known) if _are_alike(one, other)]
        numbers[index] = same[0] if same else len(known)
        if not same:
            known.append(one)
    return numbers


def _are_alike(one: FloatArray, other: FloatArray) -> bool:
    """Tell whether two periods, (period, n_inputs) each, are alike, wherever they begin."""
    power = min(float(np.sum((p - p.mean(axis=0)) ** 2)) for p in (one, other))
    spectra = np.sum(rfft(one, axis=0).conj() * rfft(other, axis=0), axis=1)
    common = float(irfft(spectra, len(one)).max())
    off = float(np.sum(one**2) + np.sum(other**2)) - 2 * common
    return off <= ALIKE * power


def standardized(inputs: FloatArray) -> FloatArray:
    """Scale inputs, (N, n_inputs), to mean 0 and deviation 1; leave out those that never move.

    What is not finite counts as the mean.
    """
    kept = np.where(np.isfinite(inputs), inputs, np.nan)
    kept = kept[:, [bool(np.nanmax(c) > np.nanmin(c)) for c in kept.T if np.isfinite(c).any()]]
    centred = np.nan_to_num(kept - np.nanmean(kept, axis=0)) if kept.size else kept
    return np.asarray(centred / centred.std(axis=0)) if kept.size else centred


def _autocorrelation(scaled: FloatArray) -> FloatArray:
    """Compute 2 sum x[k] x[k+lag] / sum(x[k]^2 + x[k+lag]^2) for all lags, shape (N,)."""
    length = len(scaled)
    size = next_fast_len(2 * length, real=True)
    products = np.zeros(length)
    for channel in scaled.T:
        spectrum = rfft(channel, size)
        products += irfft(np.abs(spectrum) ** 2, size)[:length]
    powers = np.cumsum(np.sum(scaled**2, axis=1))
    first = powers[::-1]  # of the samples that have a partner behind them
    second = powers[-1] - np.concatenate([[0.0], powers[:-1]])  # of those partners
    return np.asarray(2 * products / np.maximum(first + second, 1e-300))


def _is_peak(values: FloatArray) -> NDArray[np.bool_]:
    """Tell which values are not smaller than both neighbours."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    return (values >= padded[:-2]) & (values >= padded[2:])


def _repeated(scaled: FloatArray, period: int) -> NDArray[np.bool_]:
    """Tell which samples lie in two periods one after the other that are alike, shape (N,)."""
    length, channels = scaled.shape
    off = np.sum((scaled[period:] - scaled[:-period]) ** 2, axis=1)
    power = np.sum([_variances(channel, period) for channel in scaled.T], axis=0)
    moves = power > MOVES * period * channels
    alike = _sums(off, period) <= ALIKE * np.minimum(power[:-period], power[period:])
    begins = np.flatnonzero(alike & moves[:-period])
    marks = np.zeros(length + 1)
    np.add.at(marks, begins, 1.0)
    np.add.at(marks, begins + 2 * period, -1.0)
    return np.asarray(np.cumsum(marks)[:length] > 0.5)


def _sums(values: FloatArray, length: int) -> FloatArray:
    """Compute the sums over all windows of a length, (N,) to (N - length + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[length:] - total[:-length])


def _variances(values: FloatArray, length: int) -> FloatArray:
    """Compute the sums of squares about the mean of all windows of a length."""
    return _sums(values**2, length) - _sums(values, length) ** 2 / length
