"""Measures of error have one definition for training, estimator and report."""

from __future__ import annotations

import sys

import numpy as np

from slide_fmu.core.readable import ratio_text
from slide_fmu.core.signals import FloatArray

TINY = sys.float_info.min
"""Nothing is divided by less, so that figures of a reference at rest stay finite."""


def rms(values: FloatArray) -> FloatArray:
    """Compute the root mean square over all samples, (..., n_channels) to (n_channels,)."""
    return np.asarray(np.sqrt(np.mean(values.reshape(-1, values.shape[-1]) ** 2, axis=0)))


def size_about(truth: FloatArray, mean: FloatArray) -> FloatArray:
    """Return the RMS about a mean, (n_channels,), of true outputs, (N, n_channels); at least TINY.

    Errors are relative to it.
    """
    return np.maximum(rms(truth - mean), TINY)


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
