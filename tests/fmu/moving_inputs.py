"""Inputs that move and are set to what they are at the start of a step, in plain loops.

Apart from ``slide_fmu.surrogate.input_forecast`` and from the C runtime, which share no code with
it.
"""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.plain import Resampling, plain_moved
from tests.fmu.samples import forecast_of


def forecasting(
    surrogate: Surrogate, at_step_end: bool = False, planned: bool = False
) -> Surrogate:
    """The surrogate with a forecast of every input."""
    forecast = forecast_of(len(surrogate.inputs), at_step_end, planned)
    return dataclasses.replace(surrogate, forecast=forecast)


def n_points(forecast: InputForecast) -> int:
    """The number of inputs, one step apart, that a forecast looks at."""
    return max(int(forecast.weights.shape[2]), 3) + forecast.n_scored + 1


def plain_change(forecast: InputForecast, index: int, x: list[float], steps: float) -> float:
    """The change expected after values H apart, newest first."""
    largest = forecast.largest_change[index] * steps

    def change(weights: FloatArray, at: int) -> float:
        found = sum(w * (x[at + i + 1] - x[at]) for i, w in enumerate(weights))
        return min(max(found, -largest), largest)

    best, least = 0.0, 0.5 * sum((x[j] - x[j + 1]) ** 2 for j in range(forecast.n_scored))
    cubic = np.array([-6.0, 4.0, -1.0])
    for weights, better in [*((one, 1.0) for one in forecast.weights[index]), (cubic, 0.5)]:
        errors = [x[j] - x[j + 1] - change(weights, j + 1) for j in range(forecast.n_scored)]
        if (score := sum(error**2 for error in errors)) < better * least:
            best, least = change(weights, 0), score
    return best


def plain_ahead(surrogate: Surrogate, past: list[FloatArray], steps: float) -> FloatArray:
    """The inputs expected a step after these, newest first."""
    forecast, ahead = surrogate.forecast, np.array(past[0])
    assert forecast is not None
    for i, signal in enumerate(surrogate.inputs):
        if signal.angle == "cosine":
            angles = [0.0]
            for later, before in itertools.pairwise(past):
                turn = np.angle(complex(*before[i : i + 2]) / complex(*later[i : i + 2]))
                angles.append(angles[-1] + float(turn))
            z = complex(*past[0][i : i + 2])
            z *= np.exp(1j * plain_change(forecast, i, angles, steps))
            ahead[i : i + 2] = z.real, z.imag
        elif signal.angle is None:
            offset, scale = (getattr(surrogate.input_scaling, n)[i] for n in ("offset", "scale"))
            value = past[0][i] + plain_change(forecast, i, [row[i] for row in past], steps)
            low, high = min(past[0][i], offset - scale), max(past[0][i], offset + scale)
            ahead[i] = min(max(value, low), high)
    return ahead


class Moving:
    """The exact window behind every step, and what is expected within the last one. Final.

    Attributes:
        surrogate: what is evaluated.
        known: its true inputs until now.
    """

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate, self.known, self._last = surrogate, Resampling(surrogate), math.nan

    def step(
        self, length: float, inputs: FloatArray, rates: FloatArray | None = None
    ) -> Resampling:
        """Set inputs, take a step, and give the window that is expected at its end."""
        h = self.surrogate.window.step
        self.known.append(h if math.isnan(self._last) else self._last, inputs)
        self._last = length
        if rates is None:
            forecast = self.surrogate.forecast
            count = 0 if forecast is None else n_points(forecast)
            end = sum(self.known.lengths)
            past = [self.known.input_from(end - i * length - h) for i in range(count)]
            goal = inputs if count == 0 else plain_ahead(self.surrogate, past, length / h)
        else:
            goal = plain_moved(self.surrogate, inputs, rates, length)
        expected = Resampling(self.surrogate)
        expected.lengths = [*self.known.lengths, length]
        expected.inputs = [*self.known.inputs, goal]
        return expected


def moving_inputs(surrogate: Surrogate, count: int, seed: int = 0) -> FloatArray:
    """Inputs in their ranges, (count, n_inputs): smooth, then noisy, then at rest, then smooth."""
    rng, n = np.random.default_rng(seed), len(surrogate.inputs)
    time = np.arange(count)[:, None]
    smooth = 0.5 * np.sin(time * rng.uniform(0.1, 0.5, n) + rng.uniform(0, 6, n))
    smooth += 0.2 * np.sin(time * rng.uniform(0.5, 0.9, n))
    part = np.arange(count) * 4 // count
    smooth[part == 1] += rng.normal(0, 0.3, (np.sum(part == 1), n))
    smooth[part == 2] = smooth[part == 2][:1]
    rows = surrogate.input_scaling.invert(np.clip(smooth, -1, 1))
    for i, signal in enumerate(surrogate.inputs):
        if signal.angle == "cosine":
            angle, scale = 5 * smooth[:, i], surrogate.input_scaling.scale[i]
            rows[:, i], rows[:, i + 1] = scale * np.cos(angle), scale * np.sin(angle)
    return rows
