"""Linear starts: known systems are found again from their eigenvalues."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from slide_fmu.fitting.state_space.linear_start import (
    LARGEST_POLE,
    LinearModel,
    band_edge,
    excited_eigenvalues,
    from_eigenvalues,
    lowest_eigenvalues,
    states_of,
)
from tests.fitting.state_space.cells import random

EXACT = 1e-7
"""Poles from a decomposition in float64, of systems whose last states show little."""
STEP = 0.1


def poles(m: LinearModel) -> np.ndarray:
    return np.sort_complex(np.linalg.eigvals(m.a.numpy()).round(12))


EIGENVALUES = np.array([-0.5 + 4j, -3.0, -1.0 + 9j])


def test_eigenvalues_give_the_poles() -> None:
    found = from_eigenvalues(EIGENVALUES, STEP, (2, 3), torch.Generator().manual_seed(1))
    pairs = np.concatenate([EIGENVALUES, EIGENVALUES[[0, 2]].conj()])
    assert poles(found) == pytest.approx(np.sort_complex(np.exp(pairs * STEP)), abs=EXACT)
    assert (found.a.shape, found.b.shape, found.c.shape) == ((5, 5), (5, 2), (3, 5))
    again = from_eigenvalues(EIGENVALUES, STEP, (2, 3), torch.Generator().manual_seed(1))
    other = from_eigenvalues(EIGENVALUES, STEP, (2, 3), torch.Generator().manual_seed(2))
    assert torch.equal(found.b, again.b)
    assert torch.equal(found.c, again.c)
    assert torch.equal(found.a, again.a)
    assert torch.equal(found.a, other.a)
    assert not torch.equal(found.b, other.b)
    assert not torch.equal(found.c, other.c)


def test_states_of_pairs_and_single_eigenvalues() -> None:
    assert states_of(EIGENVALUES) == 5
    assert states_of(EIGENVALUES[1:2]) == 1


@pytest.mark.parametrize(
    ("order", "chosen"),
    [
        (1, [-3.0]),
        (3, [-3.0, -0.5 + 4j]),
        (5, [-3.0, -0.5 + 4j, -1.0 + 9j]),
        (2, None),
        (4, None),
        (6, None),
    ],
)
def test_lowest_eigenvalues_have_as_many_states_as_asked_for(
    order: int, chosen: list[complex] | None
) -> None:
    """Slow ones first, whatever their order; half a pair is none."""
    for shuffled in (EIGENVALUES, EIGENVALUES[::-1], np.roll(EIGENVALUES, 1)):
        found = lowest_eigenvalues(shuffled, order)
        assert (None if found is None else found.tolist()) == chosen
    assert lowest_eigenvalues(EIGENVALUES[:0], order) is None


BIN = 2 * math.pi / (400 * STEP)
"""Angular frequency in rad/s of one oscillation in a record."""


def sines(oscillations: float) -> torch.Tensor:
    """Two sines of so many oscillations in the record, shape (2, 400, 1)."""
    time = STEP * torch.arange(400, dtype=torch.float64)
    phases = torch.tensor([[0.0], [1.0]], dtype=torch.float64)
    return torch.sin(oscillations * BIN * time + phases)[..., None]


@pytest.mark.parametrize("oscillations", [1.0, 1.37, 6.5, 32.0, 40 / (2 * math.pi), 150.25])
@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_band_ends_at_the_frequency_of_a_sine(oscillations: float, offset: float) -> None:
    """Whether it closes within the record or not: the fading widens it by two bins at most."""
    edge = band_edge(0.3 * sines(oscillations) + offset, STEP)
    assert oscillations - 0.5 < edge / BIN < oscillations + 2.5


def test_band_of_white_noise_is_all_there_is() -> None:
    assert band_edge(random(5, 400, 2), STEP) == pytest.approx(math.pi / STEP, rel=0.01)


@pytest.mark.parametrize(
    ("inputs", "chosen"),
    [
        (random(3, 400, 2), [-3.0, -0.5 + 4j, -1.0 + 9j]),
        (sines(38), [-3.0, -0.5 + 4j]),
        (sines(3), [-3.0]),
        (sines(1 / BIN), [-3.0]),
        (torch.ones(1, 400, 1, dtype=torch.float64), [-3.0]),
        (torch.zeros(1, 400, 1, dtype=torch.float64), [-3.0]),
    ],
    ids=["white", "medium", "slow", "not closed", "held", "nothing"],
)
def test_excited_eigenvalues_lie_in_the_band(inputs: torch.Tensor, chosen: list[complex]) -> None:
    """The lowest first, and at least one."""
    assert excited_eigenvalues(EIGENVALUES, inputs, STEP).tolist() == chosen


def test_poles_outside_the_circle_are_pulled_in() -> None:
    growing = np.array([0.3 + 4j, -3.0, 0.5])
    found = from_eigenvalues(growing, STEP, (1, 1), torch.Generator())
    pulled = LARGEST_POLE * np.exp(1j * 0.4)
    expected = [pulled, pulled.conjugate(), np.exp(-0.3), LARGEST_POLE]
    assert poles(found) == pytest.approx(np.sort_complex(expected), abs=EXACT)
