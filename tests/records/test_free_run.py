"""Free runs of surrogates along records that start in mid-motion."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.network import StateSpace
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
