"""How far fitted parameters may be off: from noise of any colour, and from the surrogate's error.

Residuals follow each other closely where a sensor drifts, is filtered, or the model errs: formulas
for white noise would promise far too much. So whole blocks of the record are left out in turn (a
jackknife, linearised about the fit), each several times as long as the residuals remember.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from slide_fmu.core.signals import FloatArray

LEVEL = 0.95

MOST_BLOCKS, FEWEST_BLOCKS = 20, 6
PER_BLOCK = 10
"""A block has at least so many times the correlation time of what drives the fit."""

NO_INFORMATION = 1e-6
"""What is known of every z before: a standard deviation of 1000 of its ranges, next to nothing. It
keeps what the record does not determine finite."""

CUT_OFF = 5
"""A correlation time is summed up to so many times itself (Sokal, 1997)."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """An Uncertainty is about parameters z.

    Attributes:
        half_widths: half of the 95 % intervals, shape (n_free,).
        correlation: of the parameters, shape (n_free, n_free).
        correlation_time: how long what drives the fit remembers, in samples.
        short: whether the record is too short for that, and the intervals may be too narrow.
    """

    half_widths: FloatArray
    correlation: FloatArray
    correlation_time: float
    short: bool


def uncertainty_of(residuals: FloatArray, slopes: FloatArray, own_error: float) -> Uncertainty:
    """Find out how far a fit may be off.

    The part of the noise is the larger one of the jackknife's and that of white noise, by the
    quantile of Student's t for the number of blocks. The surrogate's own error may, at worst, look
    like a change of the parameters: that bound is added by its square.

    Args:
        residuals: in standard deviations of the noise, shape (T, n_outputs).
        slopes: their derivatives by z, shape (T, n_outputs, n_free).
        own_error: sum of the squares of the surrogate's own error over all that was measured, in
            the same unit.
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

    At a bound the scores do not add to 0: their mean is no noise.
    """
    centred = scores - scores.mean(axis=0)
    moved = []
    for rows in np.array_split(np.arange(len(scores)), blocks):
        rest = whole - information[rows].sum(axis=0)
        moved.append(np.linalg.solve(rest, centred[rows].sum(axis=0)))
    shifts = np.array(moved)
    return np.asarray((blocks - 1) / blocks * shifts.T @ shifts)


def correlation_time(series: FloatArray) -> float:
    """Return how many samples apart values count as new ones: 1 of white noise, or more.

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
