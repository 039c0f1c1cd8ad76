"""Measures of error have one definition for training, estimator and report."""

from __future__ import annotations

import sys

import numpy as np

from slide_fmu.core.readable import ratio_text
from slide_fmu.core.signals import FloatArray

TINY = sys.float_info.min
"""Nothing is divided by less, so that figures of a reference at rest stay finite."""

ROUNDING = 1e-9
"""Largest relative difference of a constant from its mean: the mean of many samples is rounded."""

FEWEST = 12
"""Fewest motions of a kind by which it is judged: errors of one or two may be several times those
of others."""


def rms(values: FloatArray) -> FloatArray:
    """Compute the root mean square over all samples, (..., n_channels) to (n_channels,)."""
    return np.asarray(np.sqrt(np.mean(values.reshape(-1, values.shape[-1]) ** 2, axis=0)))


def size_about(truth: FloatArray, mean: FloatArray | None = None) -> FloatArray:
    """Return the RMS about a mean, (n_channels,), of true outputs, (N, n_channels).

    The mean is their own, if none is given; then this is their standard deviation. An output that
    is constant at its mean has no size that errors could be relative to: it gets ``TINY``, and not
    the rounding of the mean.
    """
    mean = truth.mean(axis=0) if mean is None else mean
    at_mean = np.isclose(truth, mean, rtol=ROUNDING, atol=0.0)
    constant = np.all((truth == truth[:1]) & at_mean, axis=0)
    return np.where(constant, TINY, np.maximum(rms(truth - mean), TINY))


def relative_rmse(error: FloatArray, size: FloatArray) -> FloatArray:
    """Return the RMSE, (n_channels,), of errors, (N, n_channels), relative to outputs of a size.

    The size is that of ``size_about``. Where it is ``TINY``, the output does not move: the figure
    is 0 without an error, huge but finite with one, and no part of a mean over outputs.
    """
    with np.errstate(over="ignore"):
        return np.asarray(np.minimum(rms(error) / np.maximum(size, TINY), sys.float_info.max))


def moving_rms(errors: FloatArray, length: int) -> FloatArray:
    """Compute the root mean square over the last ``length`` samples, where they exist.

    Errors of shape (N, n_channels) give (N - length + 1, n_channels). The RMSE over the output
    window that ends at a sample is the target of the error estimator (paper, section on the error
    estimation network; the square is missing in print).
    """
    views = np.lib.stride_tricks.sliding_window_view(errors**2, length, axis=0)
    return np.asarray(np.sqrt(views.mean(axis=-1)))


def best_constant(errors: FloatArray) -> float:
    """Return the constant with the smallest mean relative deviation from positive errors, (N,).

    It is the median of the errors with the weights 1 / error.
    """
    ordered = np.sort(errors)
    weights = np.cumsum(1.0 / ordered)
    return float(ordered[np.searchsorted(weights, 0.5 * weights[-1])])


def percent(value: float) -> str:
    """Return a fraction in per cent with three digits."""
    return f"{ratio_text(100 * value)} %"
