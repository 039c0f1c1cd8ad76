"""Forecasts of moving inputs along whole records, as the C runtime makes them step by step."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Signal, cosines_of
from slide_fmu.surrogate.input_forecast import BETTER, InputForecast, changes_of

CUBIC = np.array([[-6.0, 4.0, -1.0]])
"""The cubic through the last four values. Candidates are fitted to motions that change suddenly.
They smooth, so the cubic is far better for smooth motions."""


def forecast_along(
    forecast: InputForecast,
    inputs: FloatArray,
    signals: tuple[Signal, ...],
    scaling: Affine,
    cubic: FloatArray = CUBIC,
) -> FloatArray:
    """Forecast each sample of sequences from the samples before it; the first one is known.

    Args:
        inputs: sequences (B, N, n_inputs), in the inputs' units; each counts as constant
            before its first sample.
        signals: the inputs.
        scaling: their scaling; a forecast that begins in its range stays in it.
        cubic: weights of the candidate that is not fitted, (1, n_past).

    Returns:
        Forecasts in the shape and the units of the inputs.
    """
    now = np.concatenate([inputs[:, :1], inputs[:, :-1]], axis=1)
    ahead = np.empty_like(now)
    turning = {index + i for index in cosines_of(signals) for i in (0, 1)}
    for index in cosines_of(signals):
        angles = np.unwrap(np.arctan2(now[:, :, index + 1], now[:, :, index]), axis=1)
        turn = _changes(forecast, index, angles, cubic)
        turned = (now[:, :, index] + 1j * now[:, :, index + 1]) * np.exp(1j * turn)
        ahead[:, :, index], ahead[:, :, index + 1] = turned.real, turned.imag
    for index in set(range(inputs.shape[2])) - turning:
        values = now[:, :, index]
        low = np.minimum(values, scaling.offset[index] - scaling.scale[index])
        high = np.maximum(values, scaling.offset[index] + scaling.scale[index])
        found = values + _changes(forecast, index, values, cubic)
        ahead[:, :, index] = np.clip(found, low, high)
    return ahead


def _changes(
    forecast: InputForecast, index: int, values: FloatArray, cubic: FloatArray
) -> FloatArray:
    """Forecast the change after each of an input's values or angles, (B, N), oldest first."""
    if not forecast.weights.shape[1]:
        return np.zeros_like(values)
    change = np.zeros_like(values)
    held, _ = _scored(forecast, np.zeros((1, 1)), index, values)
    least = BETTER * held[0]
    for weights, better in ((forecast.weights[index], 1.0), (cubic, BETTER)):
        scores, found = _scored(forecast, weights, index, values)
        best = scores.argmin(axis=0)[None]
        score = np.take_along_axis(scores, best, axis=0)[0]
        good = score < better * least
        change = np.where(good, np.take_along_axis(found, best, axis=0)[0], change)
        least = np.where(good, score, least)
    return change


def _scored(
    forecast: InputForecast, weights: FloatArray, index: int, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The squared errors of the last forecasts, and the forecasts, of candidates.

    Both have the shape (n_candidates, B, N).
    """
    n_past, largest = weights.shape[1], forecast.largest_change[index]
    held = np.pad(values, ((0, 0), (n_past + forecast.n_scored, 0)), mode="edge")
    views = np.lib.stride_tricks.sliding_window_view(held, n_past + 1, axis=1)[..., ::-1]
    found = changes_of(weights, views.reshape(-1, n_past + 1))
    found = np.clip(found, -largest, largest).reshape(-1, *views.shape[:2])
    true = np.diff(held, axis=1)[:, n_past:]  # of all forecasts except the last
    errors = (true - found[:, :, :-1]) ** 2
    windows = np.lib.stride_tricks.sliding_window_view(errors, forecast.n_scored, axis=-1)
    return windows.sum(axis=-1), found[:, :, forecast.n_scored :]
