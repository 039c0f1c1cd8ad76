"""Inputs that come again are found up to noise, wherever they are in the records."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.repeats import same_inputs
from tests.records.samples import clean_signals, multisine

EDGE = 2
"""Where one input gives way to another, this many samples may count to either."""
RNG = np.random.default_rng(0)
DRIVE, OTHER, THIRD = RNG.normal(size=(3, 4000))


def different(*inputs: FloatArray) -> int:
    """Return how many samples of inputs, (N,) or (N, n_inputs) each, are different."""
    found = same_inputs([one.reshape(len(one), -1) for one in inputs])
    assert found.shape == (sum(map(len, inputs)),)
    return int(found.max()) + 1


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("resolution", [0.0, 2 / 4096])
def test_nothing_comes_again_in_clean_signals(seed: int, resolution: float) -> None:
    for name, values in clean_signals(seed).items():
        scaled = values / values.std()
        if resolution:
            scaled = np.round(scaled / resolution) * resolution
        assert different(scaled) == len(scaled), name


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.05])
@pytest.mark.parametrize("times", [2, 2.5, 7])
@pytest.mark.parametrize("lines", [20, 60, 190])
def test_period_is_found_up_to_noise(noise: float, times: float, lines: int) -> None:
    rng = np.random.default_rng(4)
    wave = np.resize(multisine(400, rng, lines), int(times * 400))
    values = wave + noise * rng.normal(size=len(wave))
    assert abs(different(values) - 400) <= EDGE


@pytest.mark.parametrize("shape", [np.sin, lambda phase: np.sign(np.sin(phase + 0.01))])
@pytest.mark.parametrize("period", [40, 500])
def test_cycles_of_a_tone_or_a_square_wave_are_found(
    shape: Callable[[np.ndarray], np.ndarray], period: int
) -> None:
    values = shape(2 * np.pi * np.arange(5000) / period)
    assert abs(different(values + 0.01 * RNG.normal(size=5000)) - period) <= EDGE


def test_noise_of_a_third_is_no_repetition() -> None:
    rng = np.random.default_rng(4)
    wave = np.resize(multisine(400, rng), 2000)
    assert different(wave + 0.3 * rng.normal(size=2000)) == 2000


@pytest.mark.parametrize(
    ("order", "before"),
    [
        ([0, 0, 1, 1, 2, 2, 3, 3], 0),
        ([0, 0, 1, 1, 2, 2, 3, 3], 170),
        ([0, 1, 2, 3, 0, 1, 2, 3, 2], 0),
        ([0, 0, 1, 1, 2, 2, 3, 3, 1, 4], 30),
    ],
)
def test_each_of_several_waves_is_known_again(order: list[int], before: int) -> None:
    """Samples are named by their wave and their place in it; smooth waves join softly."""
    rng = np.random.default_rng(6)
    waves = [multisine(300, rng) for _ in range(max(order) + 1)]
    values = np.concatenate([waves[k] for k in order]) + 1e-3 * rng.normal(size=300 * len(order))
    names = np.concatenate([1000 * k + np.arange(300) for k in order])[before:]
    found = same_inputs([values[before:, None]])
    pairs = len(set(zip(found.tolist(), names.tolist(), strict=True)))
    assert pairs - len(set(names.tolist())) <= 2 * EDGE * len(order)
    assert pairs - len(set(found.tolist())) <= 2 * EDGE * len(order)


def test_records_that_share_inputs_at_another_offset_are_found() -> None:
    noisy = DRIVE[1000:] + 0.05 * RNG.normal(size=3000)
    assert abs(different(DRIVE, OTHER, noisy) - 8000) <= EDGE
    found = same_inputs([one[:, None] for one in (noisy, DRIVE)])
    np.testing.assert_array_equal(found[4100:6900], found[100:2900])


def test_rest_and_another_amplitude_are_no_repetition() -> None:
    rest = np.zeros(500)
    assert different(DRIVE, rest, rest, 0.5 * DRIVE) == 9000


def test_inputs_are_the_same_only_all_together() -> None:
    one, other = np.stack([DRIVE, OTHER], axis=1), np.stack([DRIVE, THIRD], axis=1)
    assert different(one, other) == 8000
    assert abs(different(one, one[:3990]) - 4000) <= EDGE


def test_inputs_that_are_missing_or_never_move_do_not_disturb() -> None:
    inputs = np.stack([np.tile(DRIVE[:500], 4), np.ones(2000)], axis=1)
    inputs[700, 0] = np.nan
    assert different(inputs) < 600
    assert different(np.ones((2000, 1))) == 2000
