"""The forecast of moving inputs is fitted to the training inputs."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, axis_positions
from slide_fmu.surrogate.input_forecast import BETTER, InputForecast, changes_of

POLYNOMIALS = np.array([[-1.0, 0.0, 0.0], [-3.0, 1.0, 0.0], [-6.0, 4.0, -1.0]])
"""A straight line, a parabola and a cubic: the candidates before the fit."""

PIECE = 16
"""Number of samples that one candidate must forecast: excitations change in a trajectory."""

ROUNDS = 4
"""Number of rounds that assign pieces to candidates and refit them; it converges soon."""

PLANNED = np.array([-6.0, 4.0, -1.0, 0.0])
"""The only candidate for planned motions before the fit: a cubic, and one more sample."""

RESOLUTION = 1e-6
"""If motions determine a candidate less than this, it stays a polynomial."""


def fit_forecast(
    signals: tuple[Signal, ...], inputs: FloatArray, planned: bool
) -> InputForecast | None:
    """Fit the forecast of inputs with a first-order hold; None for others.

    Every piece of the inputs is assigned to the candidate that forecasts it best, or to the held
    value if no candidate is clearly better. Each candidate is the least squares fit to its pieces,
    which have equal weights, whatever their amplitude.

    Planned motions are of one kind and never rough. One candidate is fitted to all their samples,
    so that large changes count most. It replaces all others if its forecasts have smaller errors.

    Args:
        signals: the inputs.
        inputs: their training samples, shape (n_trajectories, N, n_inputs).
        planned: whether they are planned motions, known ahead.
    """
    if signals[0].hold != "first_order":
        return None
    weights = np.tile(POLYNOMIALS, (len(signals), 1, 1))
    alone = np.tile(PLANNED, (len(signals), 1, 1))
    largest, gain = np.zeros(len(signals)), 0.0
    first_inputs = [index for index, signal in enumerate(signals) if signal.angle != "sine"]
    for index, values in zip(first_inputs, axis_positions(signals, inputs), strict=True):
        weights[index] = _fit(values)
        largest[index] = np.abs(np.diff(values, axis=1)).max()
        if planned:
            alone[index] = _fit_planned(values)
            gain += np.log(_rms_error(weights[index], values) / _rms_error(alone[index], values))
    return InputForecast(planned, False, alone if gain > 0 else weights, largest)


def _rms_error(weights: FloatArray, values: FloatArray) -> float:
    """Return the RMS error of forecasts of one input or angle, chosen by the last samples."""
    n_past, window = weights.shape[1], np.ones(InputForecast.n_scored)
    views = np.lib.stride_tricks.sliding_window_view(values, n_past + 2, axis=1)[:, :, ::-1]
    if views.shape[1] <= len(window):
        return 1.0
    changes = views[:, :, 0] - views[:, :, 1]
    forecast = changes_of(weights, views[:, :, 1:].reshape(-1, n_past + 1))
    squares = (np.vstack([forecast, np.zeros((1, forecast.shape[1]))]) - changes.ravel()) ** 2
    squares = squares.reshape(-1, *changes.shape)  # (candidates and the held value, motions, N)
    past = np.apply_along_axis(np.convolve, 2, squares, window, "valid")[:, :, :-1]
    past[:-1] /= BETTER
    best = past.argmin(axis=0)[None]
    ahead = np.take_along_axis(squares[:, :, len(window) :], best, axis=0)
    return float(np.sqrt(ahead.mean() + np.finfo(np.float64).tiny))


def _fit_planned(values: FloatArray) -> FloatArray:
    """Fit one candidate to all values of one input or angle, shape (n_trajectories, N)."""
    n_past = len(PLANNED)
    if values.shape[1] < n_past + 2:
        return PLANNED[None]
    windows = np.lib.stride_tricks.sliding_window_view(values, n_past + 2, axis=1)
    views = windows.reshape(-1, n_past + 2)[:, ::-1]
    rows, changes = views[:, 2:] - views[:, 1:2], views[:, 0] - views[:, 1]
    rest = np.linalg.lstsq(rows, changes - rows @ PLANNED, rcond=RESOLUTION)[0]
    return np.asarray((PLANNED + rest)[None])


def _fit(values: FloatArray) -> FloatArray:
    """Fit all candidates to the values of one input or angle, shape (n_trajectories, N)."""
    n_past = POLYNOMIALS.shape[1]
    count = (values.shape[1] - n_past - 1) // PIECE
    if count < 1:
        return POLYNOMIALS
    windows = np.lib.stride_tricks.sliding_window_view(values, n_past + 2, axis=1)
    views = windows[:, : count * PIECE, ::-1].reshape(-1, PIECE, n_past + 2)
    changes = views[:, :, 0] - views[:, :, 1]
    held = np.sum(changes**2, axis=1)
    moving = held > 0
    views, changes, held = views[moving][:, :, 1:], changes[moving], held[moving]
    weights = POLYNOMIALS
    for _ in range(ROUNDS):
        forecast = changes_of(weights, views.reshape(-1, n_past + 1)).reshape(-1, *changes.shape)
        scores = np.sum((changes - forecast) ** 2, axis=2) / held
        best = np.where(scores.min(axis=0) < BETTER, scores.argmin(axis=0), -1)
        weights = np.stack(
            [
                _fit_one(start, views[best == index], changes[best == index])
                for index, start in enumerate(POLYNOMIALS)
            ]
        )
    return weights


def _fit_one(start: FloatArray, views: FloatArray, changes: FloatArray) -> FloatArray:
    """Fit one candidate; it stays near its start in directions that its pieces leave open."""
    if len(views) == 0:
        return start
    sizes = np.sqrt(np.sum(changes**2, axis=1))[:, None]
    rows = (views[:, :, 1:] - views[:, :, :1]) / sizes[:, :, None]
    flat = rows.reshape(-1, len(start))
    wanted = (changes / sizes).reshape(-1) - flat @ start
    return np.asarray(start + np.linalg.lstsq(flat, wanted, rcond=RESOLUTION)[0])
