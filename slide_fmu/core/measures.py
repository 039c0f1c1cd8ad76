"""Measures of error: one definition for training, estimator and report."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from slide_fmu.core.signals import FloatArray


def rms(values: FloatArray) -> FloatArray:
    """Compute the root mean square over all samples, per channel.

    Args:
        values: shape (..., n_channels).

    Returns:
        Shape (n_channels,), in the values' units.
    """
    return np.asarray(np.sqrt(np.mean(values.reshape(-1, values.shape[-1]) ** 2, axis=0)))


def moving_rms(errors: FloatArray, length: int) -> FloatArray:
    """Compute the root mean square over the last ``length`` samples, where there are as many.

    The target of the error estimator (paper, section on the error estimation network, with the
    square that is missing in print): the RMSE over the output window that ends at a sample.

    Args:
        errors: shape (N, n_channels), N >= length.

    Returns:
        Shape (N - length + 1, n_channels), in the errors' units.
    """
    views = np.lib.stride_tricks.sliding_window_view(errors**2, length, axis=0)
    return np.asarray(np.sqrt(views.mean(axis=-1)))


def relative_deviation(
    estimate: FloatArray, true: FloatArray, resolution: ArrayLike
) -> FloatArray:
    """Compute how far an error estimate is from the true error, relative to the true error.

    Errors below the resolution count as the resolution, in both.

    Args:
        estimate: estimated errors, any shape, not negative.
        true: true errors, same shape.
        resolution: smallest error that is told apart, same units; broadcast.

    Returns:
        |estimate - true| / true, same shape.
    """
    floor_true = np.maximum(true, resolution)
    return np.asarray(np.abs(np.maximum(estimate, resolution) - floor_true) / floor_true)
