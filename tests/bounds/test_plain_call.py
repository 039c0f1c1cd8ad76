"""What a surrogate gives where an importer sets inputs to what they are, for its bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from slide_fmu.bounds.plain_call import plain_predictions, used_predictions

from slide_fmu.data.stored_split import Split
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import Moving, forecasting
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries

SAMPLES = 8


def split_of(surrogate: Surrogate) -> Split:
    """Two trajectories whose inputs are waves."""
    time = np.arange(60.0)[None, :, None]
    inputs = np.sin(0.2 * time + np.array([0.0, 1.0])[:, None, None])
    count = len(surrogate.inputs)
    outputs = np.zeros((2, 61, len(surrogate.outputs)))
    return Split(np.repeat(inputs, count, axis=2), outputs, np.zeros(2, np.int64))


def test_inputs_that_move_are_forecast_as_the_fmu_forecasts_them() -> None:
    build_libraries()
    surrogate = forecasting(sum_surrogate(SAMPLES, "first_order"), False)
    split, step = split_of(surrogate), surrogate.window.step
    (found,) = plain_predictions(surrogate, [split])
    for inputs, outputs in zip(split.inputs, found, strict=True):
        moving = Moving(surrogate)
        now = np.concatenate([inputs[:1], inputs[:-1]])
        expected = np.array([moving.step(step, row).results()[0] for row in now])
        np.testing.assert_allclose(outputs, expected, rtol=1e-5, atol=1e-6)
    known = surrogate.predict_newest_batch(split.inputs)
    assert np.abs(found - known)[:, SAMPLES:].max() > 1e-3


def test_held_inputs_are_known() -> None:
    surrogate = sum_surrogate(SAMPLES)
    split = split_of(surrogate)
    (found,) = plain_predictions(surrogate, [split])
    assert np.array_equal(found, surrogate.predict_newest_batch(split.inputs))


def test_planned_motions_are_mostly_known_and_others_are_forecast() -> None:
    build_libraries()
    moving = forecasting(sum_surrogate(SAMPLES, "first_order"), False)
    assert moving.forecast is not None
    planned = replace(moving, forecast=replace(moving.forecast, planned=True))
    split = split_of(moving)
    (plain,), (of_planned,) = (plain_predictions(one, [split]) for one in (moving, planned))
    assert np.array_equal(plain, of_planned)
    assert np.array_equal(used_predictions(moving, split), plain)
    known = moving.predict_newest_batch(split.inputs)
    assert np.array_equal(used_predictions(planned, split), known)
