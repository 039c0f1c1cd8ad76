"""Orders and numbers of units that state-space fits choose, or keep to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.core.window import Window
from slide_fmu.fitting.state_space import ledger, sizes, subspace
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.springs import (
    CUBIC,
    EIGENVALUES,
    FORGOTTEN,
    SMALL,
    fit,
    problem_of,
    spring,
)
from tests.marks import first


@pytest.fixture
def few_units(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search among small networks."""
    monkeypatch.setattr(sizes, "FIRST_UNITS", 4)
    monkeypatch.setattr(sizes, "MOST_UNITS", 8)


@pytest.mark.extended
@pytest.mark.usefixtures("few_units")
@pytest.mark.parametrize("eigenvalues", [EIGENVALUES, None], ids=["eigenvalues", "responses"])
@pytest.mark.parametrize("cubic", [0.0, CUBIC], ids=["linear", "nonlinear"])
def test_sizes_are_chosen(tmp_path: Path, eigenvalues: Any, cubic: float) -> None:
    found = fit(problem_of(tmp_path, cubic, eigenvalues=eigenvalues), {})
    cell = found.network.cell
    if cubic == 0:
        assert (len(cell.a), len(cell.w)) == (2, 0)
        assert found.history.explanations[-1].startswith("2 states with 0 hidden units: error ")
        assert found.error < FORGOTTEN
    else:
        assert len(cell.a) >= 2 + StateSpaceRecipe().padding
        assert len(cell.w) >= 4
        assert found.error < 3 * SMALL


@pytest.mark.extended
@pytest.mark.parametrize("share", [0.5, 0.65, 0.8])
def test_search_that_was_stopped_ends_as_one_that_was_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, share: float
) -> None:
    """Stopped while a size runs on, it compares the same errors as before."""
    monkeypatch.setattr(ledger, "STORE_EVERY", 0.0)
    for name, value in {
        "GOOD": 0.0,
        "WORTHWHILE": 0.97,
        "FIRST_UNITS": 4,
        "MOST_UNITS": 4,
    }.items():
        monkeypatch.setattr(sizes, name, value)
    network = {"order": 2}
    whole = fit(problem_of(tmp_path / "whole"), network)

    def stop(done: int, total: int, error: float | None = None) -> None:
        if done == round(share * whole.iterations):
            raise KeyboardInterrupt

    broken = problem_of(tmp_path / "broken")
    with pytest.raises(KeyboardInterrupt):
        fit(broken, network, stop)
    found = fit(broken, network)
    assert (found.iterations, found.error) == (whole.iterations, whole.error)


@pytest.mark.usefixtures("few_units")
@pytest.mark.parametrize(("given", "states"), [({"order": 3}, 3), ({"hidden": 0}, 2)])
def test_given_sizes_are_kept(tmp_path: Path, given: dict[str, int], states: int) -> None:
    cell = fit(problem_of(tmp_path, 0.0), given).network.cell
    assert len(cell.w) == 0
    assert len(cell.a) == states


@pytest.mark.extended
@pytest.mark.usefixtures("few_units")
@pytest.mark.parametrize("shown", [3, 4, 6, 7])
def test_order_falls_from_what_records_seem_to_show_to_what_does_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shown: int
) -> None:
    monkeypatch.setattr(subspace.Subspace, "states_shown", shown)
    problem = problem_of(tmp_path, 0.0, eigenvalues=None)
    found = fit(problem, {"hidden": 0})
    assert len(found.network.cell.a) == 2
    assert found.error < FORGOTTEN


@pytest.mark.usefixtures("few_units")
def test_order_that_eigenvalues_tell_does_not_fall(tmp_path: Path) -> None:
    eigenvalues = np.concatenate([EIGENVALUES, 1.2 * EIGENVALUES])
    problem = problem_of(tmp_path, 0.0, eigenvalues=eigenvalues)
    assert len(fit(problem, {"hidden": 0}).network.cell.a) == 4


@pytest.mark.extended
@pytest.mark.usefixtures("few_units")
@pytest.mark.parametrize(("samples", "states"), [(12, {1, 2, 3}), (200, {5})])
def test_search_stays_within_what_records_show(
    tmp_path: Path, samples: int, states: set[int]
) -> None:
    """Short trajectories show few states, long ones all five."""
    inputs = spring(1, 6, 6 + samples)[0]
    sums = torch.cat([0 * inputs[:, :1], inputs], 1)
    outputs = sums + 0.9 * sums.roll(1, 1) - 0.7 * sums.roll(2, 1) + 0.6 * sums.roll(3, 1)
    outputs = outputs - 0.5 * sums.roll(4, 1)
    records = inputs[:, 6:], outputs[:, 6:]
    problem = problem_of(
        tmp_path, window=Window(0.1, 6, 1), training=records, validation=records, eigenvalues=None
    )
    assert len(fit(problem, {"hidden": 0}).network.cell.a) in states


@pytest.mark.extended
@pytest.mark.usefixtures("few_units")
def test_noise_that_only_the_validation_has_is_not_answered_with_more_units(
    tmp_path: Path,
) -> None:
    """More units would learn no more of it: the search ends where the training is good."""
    inputs, outputs = spring(11, 6, 200, CUBIC)
    noise = 0.02 * torch.from_numpy(np.random.default_rng(3).normal(size=outputs.shape))
    found = fit(problem_of(tmp_path, validation=(inputs, outputs + noise)), {"order": 2})
    assert found.history.sizes[-1].units == sizes.FIRST_UNITS
    assert found.error > sizes.GOOD


@pytest.mark.extended
@pytest.mark.usefixtures("few_units")
@pytest.mark.parametrize("network", first([{"order": 2}, {"hidden": 0}, {"units": "auto"}]))
def test_table_of_a_fit_has_the_sizes_of_its_network(
    tmp_path: Path, network: dict[str, Any]
) -> None:
    """With it, another fit needs no search."""
    found = fit(problem_of(tmp_path), network, starts=1, iterations=2)
    cell, table = found.network.cell, found.table
    padding = table.padding if table.hidden else 0
    assert (table.order + padding, table.hidden) == (len(cell.a), len(cell.w))
    assert (table.units, table.substeps) == (cell.activation, cell.substeps)
