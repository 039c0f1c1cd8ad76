"""The end of a spring moves smoothly through its samples, whatever plant it moves."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mbs_models.plants.moved_plant import MOTION, MovedPlant

STEP = 0.1


def moved() -> tuple[MovedPlant, list[tuple[float, float]]]:
    """Return a plant without coordinates, and where its end has been, with its rates."""
    found: list[tuple[float, float]] = []
    plant: Any = SimpleNamespace()
    plant.coordinates = plant.velocities = lambda: np.zeros(0)
    plant.set_state = lambda coordinates, velocities: None
    plant.advance = lambda: [plant.before_substep(STEP * part) for part in (0.0, 0.5, 1.0)]
    return MovedPlant(plant, STEP, lambda position, rate: found.append((position, rate))), found


def test_end_follows_a_parabola_exactly() -> None:
    end, found = moved()
    places = 3.0 * (STEP * np.arange(8)) ** 2
    for place in places[1:]:
        end.go(place - end.position)
        end.advance()
    times = STEP * (np.arange(2, 7)[:, None] + [0.0, 0.5, 1.0]).ravel()
    expected = np.stack([3.0 * times**2, 6.0 * times], axis=1)
    assert np.array(found[6:]) == pytest.approx(expected, abs=1e-12)


def test_rate_is_continuous_and_states_keep_it() -> None:
    end, found = moved()
    rng = np.random.default_rng(0)
    for _ in range(5):
        end.go(float(rng.normal()))
        end.advance()
    ends, begins = np.array(found[2:-1:3]), np.array(found[3::3])
    assert ends == pytest.approx(begins, abs=1e-12)
    other, again = moved()
    other.set_state(end.coordinates(), end.velocities())
    assert len(end.coordinates()) == MOTION
    for one in (end, other):
        one.go(0.3)
        one.advance()
    assert again == found[-3:]
