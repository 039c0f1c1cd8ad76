"""Cubes are clipped sooner where a network does not forget far beyond its range; else never."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.memory import cube_limits
from slide_fmu.memory.cube_limits import with_stable_cubes
from slide_fmu.memory.stability import check_stability
from slide_fmu.network.state_space.cell import Cell
from slide_fmu.network.state_space.network import StateSpace
from tests.memory.small_cells import CASE, network_of, scalar_cell, surrogate_of


def mixed_cell(weight: float, effect: float) -> Cell:
    """x -> 0.5 x + u + effect clip(weight x)^3."""
    return scalar_cell(0.5, 1.0, effect, "mixed", weight)


def passes(cell: Cell) -> bool:
    tests = check_stability(surrogate_of(network_of(cell)), CASE)
    return all(test.problem is None for test in tests)


def settled_cell(cell: Cell) -> Cell:
    network = with_stable_cubes(surrogate_of(network_of(cell)), CASE).network
    assert isinstance(network, StateSpace)
    return network.cell


STEEP = mixed_cell(1.0, 0.03)
"""It is clipped at x = 8, where the cube adds 0.03 * 8^3 = 15, more than the pole takes away: at
large amplitudes there are two places of rest."""


def test_cubes_are_clipped_sooner_where_that_brings_stability() -> None:
    assert not passes(STEEP)
    found = settled_cell(STEEP)
    assert passes(found)
    assert np.array_equal(found.w, 2 * STEEP.w)


def test_network_that_passes_stays_as_it_is() -> None:
    cell = mixed_cell(0.1, 0.03)
    assert passes(cell)
    assert settled_cell(cell) is cell


def test_network_that_would_answer_otherwise_within_its_range_stays_as_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    other = network_of(scalar_cell(0.4))
    assert passes(other.cell)
    monkeypatch.setattr(cube_limits, "clipped_sooner", lambda network: other)
    assert settled_cell(STEEP) is STEEP


def test_network_of_other_units_stays_as_it_is() -> None:
    cell = scalar_cell(1.1)
    assert settled_cell(cell) is cell
