"""The quarter car of the benchmark on moving inputs, against scipy."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parent))

from quarter_car import ROAD, STEP, rates, roads, rough_road, simulate

COUNT = 80


@pytest.mark.parametrize("rough", [False, True])
def test_reference_is_the_solution_of_its_equations(rough: bool) -> None:
    """Over a road that is straight between its samples."""
    time = STEP * np.arange(COUNT)
    road = 0.08 * np.sin(9 * time) ** 2
    if rough:
        road = rough_road(np.random.default_rng(1), COUNT, 0.02, 5.0)
    state, expected = np.array([road[0], road[0], 0.0, 0.0]), []
    for k in range(COUNT):
        expected.append(rates(state[:, None], road[k : k + 1])[1][:, 0])
        if k + 1 < COUNT:
            slope = (road[k + 1] - road[k]) / STEP
            found = solve_ivp(
                lambda t, x, k=k, slope=slope: rates(x[:, None], road[k : k + 1] + slope * t)[0][
                    :, 0
                ],
                (0.0, STEP),
                state,
                rtol=1e-9,
                atol=1e-12,
            )
            state = found.y[:, -1]
    found = simulate(road[None])[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_roads_to_learn_from_are_smooth_and_rough_in_turns() -> None:
    found = roads(3, 6, 900)
    assert found.shape == (6, 900)
    assert np.abs(found).max() <= ROAD[0].high
    bends = np.abs(np.diff(found, 2, axis=1)).mean(axis=1) / np.abs(np.diff(found)).mean(axis=1)
    assert bends[::2].max() < 0.8 < bends[1::2].min()
