"""Windows on the device are those of the index law, all phases of all trajectories."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.window import Window
from slide_fmu.fitting.windows import WindowData
from tests.refusals import refused
from tests.strategies import windows


def data_of(window: Window, trajectories: int, samples: int) -> WindowData:
    rng = np.random.default_rng(samples)
    inputs = rng.normal(size=(trajectories, samples, 2))
    targets = rng.normal(size=(trajectories, samples + 1, 3))
    return WindowData(torch.from_numpy(inputs), torch.from_numpy(targets), window)


@given(windows(), st.integers(1, 3), st.integers(0, 10))
def test_windows_have_the_indices_of_the_index_law(
    window: Window, trajectories: int, extra: int
) -> None:
    data = data_of(window, trajectories, window.n_in + extra)
    found_inputs, found_targets = data.cut(torch.arange(data.n_windows))
    starts = window.starts(window.n_in + extra)
    assert data.n_windows == trajectories * len(starts)
    inputs = data.inputs.numpy()[:, window.input_indices(starts)]
    assert np.array_equal(found_inputs.numpy(), inputs.reshape(found_inputs.shape))
    targets = data.targets.numpy()[:, window.output_indices(starts)]
    assert np.array_equal(found_targets.numpy(), targets.reshape(found_targets.shape))


@pytest.mark.parametrize("count", [1, 7, 50, 1000])
def test_evenly_chosen_windows_cover_all_trajectories(count: int) -> None:
    data = data_of(Window(0.1, 4, 2), 5, 23)
    numbers = data.evenly_chosen(count).numpy()
    assert data.n_windows == 100
    assert min(count, 100) <= len(numbers) <= min(2 * count, 100)
    assert len(set(np.diff(numbers).tolist())) <= 1
    assert numbers[0] == 0
    assert 100 - numbers[-1] <= max(1, 100 // count)


def test_too_short_trajectories_are_named() -> None:
    with refused(ValueError, "n_in = 4", "expected at least n_in ="):
        data_of(Window(0.1, 4, 2), 1, 3)
