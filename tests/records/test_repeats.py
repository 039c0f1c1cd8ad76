"""The noise of outputs that repeats of the inputs show."""

import numpy as np
import pytest
import scipy.signal

from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.records.repeats import noise_of_repeats

LEAD, KNOWN = 60, 0.02


def record(inputs: FloatArray, noise: FloatArray) -> Trajectory:
    """Two outputs of a filter that forgets within the lead, with their noise; inputs (N,)."""
    answer = scipy.signal.lfilter([0.3], [1, -0.8], inputs)
    outputs = np.stack([answer, answer**3], axis=1)
    outputs = np.concatenate([np.zeros((1, 2)), outputs + noise])
    return Trajectory(0.01, inputs[:, None], outputs)


def white(count: int) -> FloatArray:
    return np.random.default_rng(1).normal(0, KNOWN, (count, 2))


def test_noise_of_any_colour_is_found_where_inputs_repeat_a_period() -> None:
    inputs = np.tile(np.random.default_rng(0).normal(size=500), 8)
    noise = white(len(inputs))
    noise[:, 1] = scipy.signal.lfilter([np.sqrt(1 - 0.9**2)], [1, -0.9], noise[:, 1])
    found = noise_of_repeats([record(inputs, noise)], LEAD)
    assert found == pytest.approx([KNOWN, KNOWN], rel=0.1)


def test_noise_is_found_where_each_of_several_periods_comes_twice() -> None:
    rng = np.random.default_rng(0)
    inputs = np.concatenate([np.tile(rng.normal(size=500), 2) for _ in range(6)])
    found = noise_of_repeats([record(inputs, white(len(inputs)))], LEAD)
    assert found == pytest.approx([KNOWN, KNOWN], rel=0.1)


def test_nothing_is_said_where_inputs_never_repeat() -> None:
    inputs = np.random.default_rng(0).normal(size=4000)
    assert noise_of_repeats([record(inputs, white(4000))], LEAD) is None


def test_nothing_is_said_where_the_system_remembers_longer_than_inputs_repeat() -> None:
    inputs = np.tile(np.random.default_rng(0).normal(size=500), 2)
    assert noise_of_repeats([record(inputs, white(1000))], 600) is None
