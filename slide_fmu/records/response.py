"""This module tells by linear fits whether an output answers the inputs, and when.

Inputs are whitened by an autoregression, and the output is filtered alike. Their cross-correlation
is then the impulse response (Ljung, 1999, section 6.1), with a standard deviation of 1 / sqrt(N)
where the output does not answer.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import correlate, lfilter

from slide_fmu.core.autoregression import fit_autoregression
from slide_fmu.core.signals import FloatArray

ORDER = 12
"""Number of past samples in a fit, and of samples until a filter has settled."""

CERTAIN = 5.5
"""A correlation counts if it is this multiple of its standard deviation: among thousands of lags,
chance reaches it once in ten thousand records."""

FLOOR = 1e-6
"""Inputs are whitened down to this part of their standard deviation."""

FEWEST = 200
"""Fewer samples tell no dead time, and no noise."""

EXPLAINED = 2.0
"""White noise is explained by chance alone: by less than this multiple of what chance explains."""


def dead_time(inputs: FloatArray, output: FloatArray) -> int | None:
    """Return after how many samples an output answers one of the inputs first.

    Args:
        inputs: shape (N, n_inputs), without gaps.
        output: shape (N,).

    Returns:
        None where no answer is certain within a quarter of the samples.
    """
    count = len(output)
    if count < FEWEST:
        return None
    found = []
    for values in inputs.T:
        whitening = _whitening(values)
        if whitening is None:
            continue
        white = _scaled(lfilter(whitening, [1.0], values - values.mean())[ORDER:])
        answer = _scaled(lfilter(whitening, [1.0], output - output.mean())[ORDER:])
        full = correlate(answer, white, mode="full")[len(white) - 1 :]
        sure = np.abs(full[: count // 4]) > CERTAIN * np.sqrt(len(white))
        found += [int(np.argmax(sure))] if sure.any() else []
    return min(found, default=None)


def is_white_noise(inputs: FloatArray, output: FloatArray) -> bool:
    """Tell whether nothing in a record says anything about an output.

    A linear fit by the output's own past and by the inputs and their squares, around the sample,
    explains no more than chance does.
    """
    rows = np.arange(ORDER, len(output))
    drives = np.concatenate([inputs, (inputs - inputs.mean(axis=0)) ** 2], axis=1)
    past = [output[rows - lag] for lag in range(1, ORDER + 1)]
    driven = [drives[rows - lag] for lag in range(ORDER + 1)]
    table = np.concatenate([np.stack([*past, np.ones(len(rows))], axis=1), *driven], axis=1)
    if len(output) < FEWEST or len(rows) < 3 * table.shape[1]:
        return False
    table = table / np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    target = output[rows] - output[rows].mean()
    left = target - table @ np.linalg.lstsq(table, target, rcond=1e-12)[0]
    explained = 1.0 - float(left @ left) / max(float(target @ target), 1e-300)
    return bool(explained < EXPLAINED * table.shape[1] / len(rows))


def _whitening(values: FloatArray) -> FloatArray | None:
    """Return the coefficients that whiten an input; None where it stands still."""
    if np.ptp(values) == 0.0:
        return None
    predictor = fit_autoregression([values], FLOOR * float(values.std())).predictors[-1]
    return np.asarray(np.concatenate([[1.0], -predictor]))


def _scaled(values: FloatArray) -> FloatArray:
    return np.asarray((values - values.mean()) / max(float(values.std()), 1e-300))
