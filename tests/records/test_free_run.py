"""Free runs of surrogates along records that start in mid-motion."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.records.remarks import costs_of_start
from slide_fmu.records.validation import free_run
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, Shape, random_surrogate

SLOW = Shape(n_outputs=2, n_inputs=1, n_in=12, n_out=4, cell=CellShape(contraction=0.97), seed=5)
"""It forgets its state long after its window."""
ROUNDING = 2e-3
"""Of outputs of about 1, from an initial state that is found in noise-free outputs."""


def surrogate_and_record() -> tuple[Surrogate, FloatArray, FloatArray]:
    """A surrogate, inputs (N, 1) and what its network answers that has run for long, (N, 2)."""
    surrogate = random_surrogate(SLOW)
    network = surrogate.network
    assert isinstance(network, StateSpace)
    low, high = surrogate.inputs[0].low, surrogate.inputs[0].high
    inputs = np.random.default_rng(2).uniform(low, high, (700, 1))
    features = network.features.along(surrogate.input_scaling.apply(inputs)[None])
    values = network.run(features)[0][0].astype(np.float64)
    return surrogate, inputs[400:], surrogate.output_scaling.invert(values)[400:]


def test_free_run_follows_a_record_that_begins_in_mid_motion() -> None:
    surrogate, inputs, measured = surrogate_and_record()
    found = free_run(surrogate, inputs, measured)
    assert found is not None
    size = surrogate.output_scaling.scale
    assert np.all(found.error < ROUNDING * size)
    assert np.max(np.abs(found.outputs[50:] - measured[50:]) / size) < 10 * ROUNDING
    truncated = surrogate.predict_newest(inputs)[50:] - measured[50:]
    assert np.all(np.sqrt(np.mean(truncated**2, axis=0)) > 10 * found.error)


def test_error_is_that_of_the_known_samples_after_the_first() -> None:
    surrogate, inputs, measured = surrogate_and_record()
    changed = measured.copy()
    changed[30:60] += 0.5
    changed[70:80] = np.nan
    found = free_run(surrogate, inputs, changed, first_samples=30)
    assert found is not None
    assert found.first_samples == 30
    expected = np.sqrt(30 / 260) * 0.5  # 270 samples, of which 10 are not known
    assert found.error == pytest.approx([expected, expected], rel=0.05)


def test_network_without_a_state_has_no_free_run() -> None:
    surrogate = random_surrogate(replace(SLOW, cell=None))
    assert free_run(surrogate, np.zeros((99, 1)), np.zeros((99, 2))) is None


@pytest.mark.parametrize("first", [0, 300])
def test_record_without_samples_to_score_is_refused(first: int) -> None:
    surrogate, inputs, measured = surrogate_and_record()
    message = f"record of 300 samples, the initial state from {first} of them"
    with pytest.raises(ValueError, match=re.escape(message)):
        free_run(surrogate, inputs, measured, first_samples=first)


def test_known_outputs_say_where_a_prediction_begins() -> None:
    """Until the window is filled the network runs from there, and then in blocks as ever."""
    surrogate, inputs, measured = surrogate_and_record()
    n_in, known = surrogate.window.n_in, measured[:8].copy()
    known[3] = np.nan
    found = surrogate.predict(inputs, known_outputs=known)
    without = surrogate.predict(inputs)
    size = surrogate.output_scaling.scale
    assert np.max(np.abs(found[:n_in] - measured[:n_in]) / size) < 10 * ROUNDING
    assert np.max(np.abs(without[:n_in] - measured[:n_in]) / size) > 0.1
    np.testing.assert_array_equal(found[n_in:], without[n_in:])


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (np.full((5, 2), np.nan), "0 of them finite"),
        (np.zeros((5, 1)), r"known_outputs of shape \(5, 1\)"),
        (np.zeros((301, 2)), "with K from 1 to 300"),
        (np.zeros((0, 2)), "at least one that is known"),
    ],
)
def test_known_outputs_that_do_not_fit_are_refused(known: FloatArray, message: str) -> None:
    surrogate, inputs, _ = surrogate_and_record()
    with pytest.raises(ValueError, match=message):
        surrogate.predict(inputs[:300], known_outputs=known)


def test_known_outputs_are_refused_where_there_is_no_state() -> None:
    surrogate = random_surrogate(replace(SLOW, cell=None))
    with pytest.raises(ValueError, match="whose network has no state; expected none"):
        surrogate.predict(np.zeros((99, 1)), known_outputs=np.zeros((9, 2)))


def test_report_says_what_an_unknown_start_costs() -> None:
    surrogate, inputs, measured = surrogate_and_record()
    comparison = SimpleNamespace(inputs=inputs, reference=measured, parameters={})
    size = measured.std(axis=0)
    outputs = tuple(SimpleNamespace(rms_reference_about_mean=float(one)) for one in size)
    longer = replace_window(surrogate, 120)
    validation: Any = SimpleNamespace(
        surrogate=longer,
        comparisons=(comparison,),
        figures=lambda: SimpleNamespace(outputs=outputs),
    )
    costs = costs_of_start(validation)
    assert costs is not None
    unknown, known = costs
    expected = (longer.predict(inputs[:120]) - measured[:120])[50:]
    np.testing.assert_allclose(unknown, np.sqrt(np.mean(expected**2, axis=0)) / size)
    assert np.all(known < 0.1 * unknown)


def replace_window(surrogate: Surrogate, n_in: int) -> Surrogate:
    """The same surrogate with another window; its network forgets over hundreds of samples."""
    network, n_out = surrogate.network, surrogate.window.n_out
    assert isinstance(network, StateSpace)
    other = StateSpace(network.cell, n_in, n_out, network.features, network.roles)
    window = replace(surrogate.window, n_in=n_in)
    return replace(surrogate, window=window, network=other)
