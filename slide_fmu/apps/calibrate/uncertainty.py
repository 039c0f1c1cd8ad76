"""The uncertainty of fitted parameters includes noise of any colour and the surrogate's error.

Residuals are correlated if a sensor drifts or is filtered, or the model is wrong: formulas for
white noise would give intervals that are far too narrow. So whole blocks of the record are
left out in turn (a jackknife, linearised about the fit), each several times as long as the
correlation time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from slide_fmu.core.signals import FloatArray

LEVEL = 0.95

MOST_BLOCKS, FEWEST_BLOCKS = 20, 6
PER_BLOCK = 10
"""Smallest length of a block, in correlation times of the scores of the fit."""

NO_INFORMATION = 1e-6
"""Prior knowledge of every z: a standard deviation of 1000 of its ranges, which is almost none. It
keeps parameters finite that the record does not determine."""

CUT_OFF = 5
"""A correlation time is summed up to this multiple of itself (Sokal, 1997)."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """An Uncertainty belongs to parameters z.

    Attributes:
        half_widths: half of the 95 % intervals, shape (n_free,).
        correlation: of the parameters, shape (n_free, n_free).
        correlation_time: correlation time of the scores of the fit, in samples.
        short: whether the record is too short for that, so that the intervals may be too narrow.
    """

    half_widths: FloatArray
    correlation: FloatArray
    correlation_time: float
    short: bool


def uncertainty_of(residuals: FloatArray, slopes: FloatArray, own_error: float) -> Uncertainty:
    """Compute the uncertainty of a fit.

    The noise's part is the larger of the jackknife's and that of white noise, with the quantile of
    Student's t for the number of blocks. In the worst case the surrogate's own error looks like a
    change of the parameters: this bound is added by its square.

    Args:
        residuals: in standard deviations of the noise, shape (T, n_outputs).
        slopes: their derivatives by z, shape (T, n_outputs, n_free).
        own_error: sum of the squares of the surrogate's own error over all measurements, in the
            same unit.
    """
    n_free = slopes.shape[-1]
    scores = np.einsum("tj,tji->ti", residuals, slopes)
    information = np.einsum("tji,tjk->tik", slopes, slopes)
    whole = information.sum(axis=0) + NO_INFORMATION * np.eye(n_free)
    white = np.linalg.inv(whole)
    time = correlation_time(scores)
    wanted = int(len(scores) / (PER_BLOCK * time))
    blocks = int(np.clip(wanted, FEWEST_BLOCKS, MOST_BLOCKS))
    coloured = _jackknife(scores, information, whole, blocks)
    larger = np.maximum(np.diag(white), np.diag(coloured))
    quantile = student.ppf(0.5 * (1 + LEVEL), max(1, blocks - n_free))
    at_worst = np.diag(white) * own_error
    half_widths = np.sqrt(quantile**2 * larger + at_worst)
    deviations = np.sqrt(np.diag(white))
    correlation = white / np.outer(deviations, deviations)
    return Uncertainty(half_widths, correlation, time, wanted < FEWEST_BLOCKS)


def _jackknife(
    scores: FloatArray, information: FloatArray, whole: FloatArray, blocks: int
) -> FloatArray:
    """Return the covariance of fits without one block each, shape (n_free, n_free).

    At a bound the scores do not add to 0: their mean is not noise.
    """
    centred = scores - scores.mean(axis=0)
    moved = []
    for rows in np.array_split(np.arange(len(scores)), blocks):
        rest = whole - information[rows].sum(axis=0)
        moved.append(np.linalg.solve(rest, centred[rows].sum(axis=0)))
    shifts = np.array(moved)
    return np.asarray((blocks - 1) / blocks * shifts.T @ shifts)


def correlation_time(series: FloatArray) -> float:
    """Return the distance in samples at which values are independent: 1 for white noise, or more.

    It is the largest one of the columns, shape (N, n), each about its mean.
    """
    off = series - series.mean(axis=0)
    spectrum = np.abs(np.fft.rfft(off, 2 * len(off), axis=0)) ** 2
    covariances = np.fft.irfft(spectrum, axis=0)[: len(off)]
    longest = 1.0
    for column in covariances.T:
        if column[0] > 0:
            sums = 2 * np.cumsum(column / column[0]) - 1
            settled = np.flatnonzero(np.arange(len(sums)) >= CUT_OFF * sums)
            longest = max(longest, float(sums[settled[0] if len(settled) else -1]))
    return longest
