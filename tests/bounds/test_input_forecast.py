"""The forecast of inputs learns what the inputs of the training do."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.bounds.input_forecast import POLYNOMIALS, fit_forecast
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.surrogate.input_forecast import InputForecast
from tests.bounds.forecast_along import CUBIC, forecast_along
from tests.fmu.moving_inputs import n_points, plain_ahead

ROAD = (Signal("road", "m", -1.0, 1.0, hold="first_order"),)
ANGLE = tuple(
    Signal(f"director_{axis}", "1", -1.0, 1.0, start=start, hold="first_order", angle=part)
    for axis, start, part in (("x", 1.0, "cosine"), ("y", 0.0, "sine"))
)


def smooth(seed: int, count: int = 12, samples: int = 600) -> FloatArray:
    rng = np.random.default_rng(seed)
    frequencies, phases = rng.uniform(0.02, 0.6, (2, count, 5, 1))
    values = np.sin(frequencies * np.arange(samples) + 10 * phases)
    return np.asarray(0.15 * values.sum(axis=1))


def rough(seed: int, count: int = 12, samples: int = 600) -> FloatArray:
    steps = np.random.default_rng(seed).normal(0, 0.02, (count, samples))
    return np.asarray(np.cumsum(steps, axis=1) * 0.2)


def errors(
    forecast: InputForecast, values: FloatArray, cubic: FloatArray = CUBIC
) -> tuple[float, float]:
    """RMS of the forecast's errors, and of the held value's."""
    n, unbounded = n_points(forecast), Affine.of_channels([0.0], [1e9])
    found = forecast_along(forecast, values[None, :, None], ROAD, unbounded, cubic)[0, :, 0]
    return float(np.std((values - found)[n:])), float(np.std(np.diff(values)[n - 1 :]))


def test_one_forecast_serves_smooth_and_rough_inputs() -> None:
    """Smooth ones nearly to the end, rough ones no worse than the value that is held."""
    both = np.concatenate([smooth(0), rough(1)])[:, :, None]
    forecast = fit_forecast(ROAD, both, planned=False)
    assert forecast is not None
    wrong, held = errors(forecast, smooth(7, 1)[0])
    assert wrong < 0.04 * held
    wrong, held = errors(forecast, rough(8, 1)[0])
    assert wrong < 1.01 * held


@pytest.mark.parametrize("planned", [False, True])
def test_smooth_inputs_are_extrapolated_by_a_cubic_where_training_inputs_change_suddenly(
    planned: bool,
) -> None:
    changes = np.random.default_rng(3).choice([-1e-3, 0.0, 1e-3], (40, 100)).repeat(6, axis=1)
    ramps = np.cumsum(np.cumsum(changes, axis=1), axis=1)
    sine = np.sin(0.05 * np.arange(900))
    forecast = fit_forecast(ROAD, ramps[:, :, None], planned)
    assert forecast is not None
    with_cubic = [errors(forecast, values)[0] for values in (sine, ramps[0])]
    without = [errors(forecast, values, np.zeros((1, 1)))[0] for values in (sine, ramps[0])]
    assert with_cubic[0] < 0.1 * without[0]
    assert with_cubic[1] < 1.02 * without[1]


def test_fitted_candidates_are_better_than_polynomials() -> None:
    fast = smooth(0)[:, ::2, None]
    fitted = fit_forecast(ROAD, fast, planned=False)
    plain = InputForecast(False, False, POLYNOMIALS[None], np.ones(1))
    assert fitted is not None
    values = smooth(7, 1)[0, ::2]
    assert errors(fitted, values)[0] < 0.5 * errors(plain, values)[0]


def test_what_the_training_leaves_open_stays_a_polynomial() -> None:
    """Straight lines: every candidate knows them, none is fitted away from what it is."""
    ramps = np.linspace(-1, 1, 400) * np.array([[0.2], [0.9]])
    forecast = fit_forecast(ROAD, ramps[:, :, None], planned=False)
    assert forecast is not None
    assert not forecast.planned
    assert not forecast.at_step_end
    np.testing.assert_allclose(forecast.weights[0], POLYNOMIALS, atol=1e-6)
    assert forecast.largest_change == pytest.approx([0.9 * 2 / 399])


def test_planned_motions_have_one_candidate_that_forecasts_them_better() -> None:
    """Moves with trapezoidal speed, as drives make them: large changes count most."""
    time = np.linspace(0, 40, 1600)
    speed = np.clip(1.6 * np.sin(time), -1, 1) * np.array([[1.0], [0.3]])
    moves = np.cumsum(speed, axis=1) * (time[1] - time[0])
    several = fit_forecast(ROAD, moves[:, :, None], planned=False)
    one = fit_forecast(ROAD, moves[:, :, None], planned=True)
    assert several is not None
    assert one is not None
    assert one.planned
    assert one.weights.shape == (1, 1, 4)
    assert errors(one, moves[0])[0] < errors(several, moves[0])[0]


def test_jumps_leave_the_value_held() -> None:
    values = np.repeat(np.random.default_rng(0).uniform(-1, 1, (8, 40)), 30, axis=1)
    forecast = fit_forecast(ROAD, values[:, :, None], planned=False)
    assert forecast is not None
    found, held = errors(forecast, values[0])
    assert found == held


def test_angles_are_forecast_by_their_turn() -> None:
    angles = 8 * smooth(0)
    inputs = np.stack([np.cos(angles), np.sin(angles)], axis=2)
    forecast = fit_forecast(ANGLE, inputs, planned=False)
    assert forecast is not None
    assert forecast.largest_change[0] == pytest.approx(np.abs(np.diff(angles, axis=1)).max())
    assert forecast.largest_change[1] == 0
    angle = 8 * smooth(9, 1)[0]
    circle, scaling = np.stack([np.cos(angle), np.sin(angle)], axis=1), range_scaling(ANGLE)
    n = n_points(forecast)
    ahead = forecast_along(forecast, 0.7 * circle[None], ANGLE, scaling)[0, n:]
    np.testing.assert_allclose(np.hypot(*ahead.T), 0.7)
    wrong = np.angle((ahead @ [1, 1j]) / (circle[n:] @ [1, 1j]))
    assert np.std(wrong) < 0.04 * np.std(np.diff(angle))


def test_forecasts_are_no_larger_than_what_was_seen_and_stay_in_the_range() -> None:
    forecast = InputForecast(False, False, POLYNOMIALS[None], np.array([0.05]))
    rising = 0.07 * np.arange(1 - n_points(forecast), 1.0)
    scaling = range_scaling(ROAD)

    def next_after(values: FloatArray, forecast: InputForecast) -> float:
        record = np.append(values, 0.0)[None, :, None]  # of the last sample nothing is known
        return float(forecast_along(forecast, record, ROAD, scaling)[0, -1, 0])

    assert next_after(rising, forecast) == pytest.approx(0.05)
    quick = InputForecast(False, False, POLYNOMIALS[None], np.array([0.2]))
    assert next_after(rising, quick) == pytest.approx(rising[1] - rising[0])
    assert next_after(rising + 0.95, quick) == pytest.approx(1.0)
    assert next_after(rising + 1.5, quick) == pytest.approx(1.5)


def test_inputs_with_a_zero_order_hold_have_no_forecast() -> None:
    force = (Signal("force", "N", -1.0, 1.0),)
    assert fit_forecast(force, smooth(0)[:, :, None], planned=False) is None


def test_trajectories_too_short_to_learn_from_leave_polynomials() -> None:
    forecast = fit_forecast(ROAD, smooth(0, 3, 12)[:, :, None], planned=False)
    assert forecast is not None
    np.testing.assert_array_equal(forecast.weights[0], POLYNOMIALS)


def test_forecasts_along_records_are_those_of_each_sample() -> None:
    signals = (*ROAD, *ANGLE)
    turn = np.cumsum(smooth(3, 2, 90), axis=1)
    records = np.stack([smooth(4, 2, 90) + rough(5, 2, 90), np.cos(turn), np.sin(turn)], axis=2)
    forecast = fit_forecast(signals, records, planned=False)
    assert forecast is not None
    scaling, n = range_scaling(signals), n_points(forecast)
    found = forecast_along(forecast, records, signals, scaling)
    held = np.concatenate([np.repeat(records[:, :1], n, axis=1), records], axis=1)
    parts: Any = SimpleNamespace(forecast=forecast, inputs=signals, input_scaling=scaling)
    for k in range(90):
        past = held[:, k : k + n]  # of the first sample, it is known itself
        expected = [plain_ahead(parts, list(one[::-1]), 1.0)[0] for one in past]
        np.testing.assert_allclose(found[:, k], expected, atol=1e-12)
    assert not np.allclose(found[:, 1:, 0], records[:, :-1, 0])
