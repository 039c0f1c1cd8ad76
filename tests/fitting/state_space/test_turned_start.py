"""Linear starts of states that turn: they answer turned loads with turned values."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.fitting.state_space.linear_start import (
    LARGEST_POLE,
    MEMORIES,
    NEIGHBOURS,
    LinearModel,
    _turning_modes,
    from_turned_pairs,
)
from tests.strategies import linear_systems

ROUNDING = 1e-12
STEP = 0.05
ROCKING = np.array([-1 + 20j, -1.4 + 22j])
"""Eigenvalues in 1/s of two neighbouring oscillations."""
SWAYING = np.array([-2 + 40j, -2.2 + 45j])
HEAVING, YAWING = -0.5 + 8j, -3 + 30j
"""Oscillations of their own."""
ALL = np.array([*SWAYING, HEAVING, *ROCKING, YAWING])


def start(
    eigenvalues: np.ndarray, sizes: tuple[int, int, int, int] = (10, 4, 6, 6), seed: int = 1
) -> LinearModel:
    generator = torch.Generator().manual_seed(seed)
    return from_turned_pairs(eigenvalues, STEP, sizes, generator)


def rotation(angle: float) -> torch.Tensor:
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, -s], [s, c]], dtype=torch.float64)


def turn_of_states(order: int, pairs: int, angle: float) -> torch.Tensor:
    """The pairs turned, the further states not."""
    blocks = [rotation(angle)] * pairs + [torch.eye(1).double()] * (order - 2 * pairs)
    return torch.block_diag(*blocks)


def turn_of_vectors(count: int, angle: float) -> torch.Tensor:
    """Vectors (x, y, z) turned about z, one after the other."""
    return torch.block_diag(*[rotation(angle), torch.eye(1).double()] * (count // 3))


def poles(m: LinearModel, states: slice = slice(None)) -> np.ndarray:
    values = np.linalg.eigvals(m.a[states, states].numpy())
    return np.sort_complex(values.round(11))


def expected_poles(*eigenvalues: complex, real: tuple[float, ...] = ()) -> np.ndarray:
    """Of oscillations, each with its conjugate, and real ones."""
    waves = np.exp(np.array(eigenvalues) * STEP)
    return np.sort_complex(np.array([*waves, *waves.conj(), *real], complex))


@given(linear_systems(), st.floats(-7, 7))
def test_turned_start_turns(
    system: tuple[np.ndarray, tuple[int, int, int, int], int], angle: float
) -> None:
    """By any angle: T A = A T, T B = B R, R C = C T; whatever the eigenvalues."""
    eigenvalues, sizes, seed = system
    m = start(eigenvalues, sizes, seed)
    order, pairs, n_drive, n_outputs = sizes
    assert (m.a.shape, m.b.shape, m.c.shape) == (
        (order, order),
        (order, n_drive),
        (n_outputs, order),
    )
    turn = turn_of_states(order, pairs, angle)
    drive, outputs = turn_of_vectors(n_drive, angle), turn_of_vectors(n_outputs, angle)
    for left, right in (
        (turn @ m.a, m.a @ turn),
        (turn @ m.b, m.b @ drive),
        (outputs @ m.c, m.c @ turn),
    ):
        torch.testing.assert_close(left, right, rtol=0, atol=ROUNDING)
    radii = torch.linalg.eigvals(m.a).abs()
    assert float(radii.max()) <= LARGEST_POLE + math.sqrt(ROUNDING)  # of double eigenvalues


def test_further_states_see_and_show_z_alone() -> None:
    m = start(ALL)
    upright = [2, 5]
    level = [0, 1, 3, 4]
    assert not m.b[8:, level].any()
    assert not m.c[level, 8:].any()
    assert not m.b[:8, upright].any()
    assert not m.c[upright, :8].any()
    for part in (m.b[8:, upright], m.c[upright, 8:], m.b[:8, level], m.c[level, :8]):
        assert torch.all(part != 0)
    assert not m.a[:8, 8:].any()
    assert not m.a[8:, :8].any()


def test_modes_that_turn_are_pairs_of_neighbours() -> None:
    """In any order; what is overdamped oscillates nowhere."""
    for shuffled in (ALL, ALL[::-1], np.array([-5.0, *np.roll(ALL, 2), -0.3])):
        turning, single = _turning_modes(shuffled)
        assert turning == pytest.approx([ROCKING.mean(), SWAYING.mean()])
        assert single == [HEAVING, YAWING]
    assert _turning_modes(ALL[:0]) == ([], [])
    assert _turning_modes(np.array([1j, 0.99j * NEIGHBOURS]))[1] == []
    assert _turning_modes(np.array([1j, 1.01j * NEIGHBOURS]))[0] == []
    # of three neighbours the two lowest
    assert _turning_modes(np.array([1.2j, 1j, 1.1j])) == ([1.05j], [1.2j])


FIRST, LAST = MEMORIES


@pytest.mark.parametrize(
    ("eigenvalues", "sizes", "pairs", "others"),
    [
        (
            ALL,
            (12, 4, 3, 3),
            2 * [ROCKING.mean(), SWAYING.mean()],
            expected_poles(HEAVING, YAWING),
        ),
        (ALL, (5, 2, 3, 3), 2 * [ROCKING.mean()], expected_poles(real=(FIRST,))),
        (ALL, (6, 2, 3, 3), 2 * [ROCKING.mean()], expected_poles(HEAVING)),
        (ALL, (7, 2, 3, 3), 2 * [ROCKING.mean()], expected_poles(HEAVING, real=(FIRST,))),
        (ALL, (4, 2, 3, 3), 2 * [ROCKING.mean()], np.zeros(0)),
        (
            ROCKING,
            (6, 2, 3, 3),
            2 * [ROCKING.mean()],
            expected_poles(real=MEMORIES),
        ),
    ],
)
def test_poles_are_those_of_the_eigenvalues(
    eigenvalues: np.ndarray,
    sizes: tuple[int, int, int, int],
    pairs: list[complex],
    others: np.ndarray,
) -> None:
    m, first = start(eigenvalues, sizes), 2 * sizes[1]
    assert poles(m, slice(first)) == pytest.approx(expected_poles(*pairs), abs=1e-10)
    assert poles(m, slice(first, None)) == pytest.approx(others, abs=1e-10)


@pytest.mark.parametrize("eigenvalues", [ALL[:0], np.array([-1.0, -2.0])])
def test_without_oscillations_all_states_are_short_memories(eigenvalues: np.ndarray) -> None:
    m = start(eigenvalues, (7, 2, 3, 3))
    assert m.a.diagonal().tolist() == pytest.approx(
        [FIRST, FIRST, LAST, LAST, FIRST, (FIRST + LAST) / 2, LAST]
    )
    assert not (m.a - m.a.diagonal().diag()).any()


def test_pairs_that_no_oscillation_needs_are_short_memories() -> None:
    """Three pairs of one oscillation that turns: two and a memory."""
    m = start(ALL[2:5], (6, 3, 3, 3))
    expected = expected_poles(*2 * [ROCKING.mean()], real=(FIRST, FIRST))
    assert poles(m) == pytest.approx(expected, abs=1e-10)
    assert m.a.diagonal()[4:].tolist() == [FIRST, FIRST]


def test_growing_oscillations_are_pulled_in() -> None:
    """The radius alone: they turn still, at their frequency."""
    m = start(np.array([0.3 + 20j, 0.3 + 22j]), (4, 2, 3, 3))
    pulled = LARGEST_POLE * np.exp(21j * STEP)
    expected = np.sort_complex(np.array(2 * [pulled, pulled.conjugate()]))
    assert poles(m) == pytest.approx(expected, abs=1e-10)


def test_seed_draws_drive_and_outputs_alone() -> None:
    one, again, other = start(ALL), start(ALL), start(ALL, seed=2)
    assert torch.equal(one.b, again.b)
    assert torch.equal(one.c, again.c)
    assert torch.equal(one.a, other.a)
    assert not torch.equal(one.b, other.b)
    assert not torch.equal(one.c, other.c)


@pytest.mark.parametrize(("n_drive", "n_outputs"), [(6, 2), (4, 3), (1, 1), (5, 6)])
def test_what_is_no_vector_is_refused(n_drive: int, n_outputs: int) -> None:
    message = (
        rf"^network\.turned_pairs = 1 with {n_drive} drives and {n_outputs} outputs; expected "
        r"vectors \(x, y, z\) of both: set turned_pairs = 0, or choose another drive$"
    )
    with pytest.raises(ValueError, match=message):
        start(ALL, (4, 1, n_drive, n_outputs))
