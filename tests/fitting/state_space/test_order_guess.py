"""Orders that a search begins and ends with where no eigenvalues are known; nothing is fitted."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from slide_fmu.fitting.state_space import sizes
from slide_fmu.fitting.state_space.sizes import choose_sizes, orders_to_try

LINEAR = {1: 0.5, 2: 0.2, 3: 0.15, 4: 0.1, 5: 0.1, 6: 0.0999, 7: 0.0999, 8: 0.0999, 9: 0.3}
"""Errors of linear models by their orders: four states do as well as more."""


def search(
    monkeypatch: pytest.MonkeyPatch,
    with_units: dict[int, float],
    shown: int = 4,
    eigenvalues: bool = False,
) -> Any:
    """A multi-start whose networks have errors by their orders, with any number of units."""

    def judge(_multi_start: Any, order: int, units: int) -> Any:
        error = with_units.get(order, 1.0) if units else LINEAR[order]
        shape = SimpleNamespace(n_units=units, n_parameters=order)
        return SimpleNamespace(error=error, training_error=error, shape=shape)

    monkeypatch.setattr(sizes, "judge", judge)
    monkeypatch.setattr(sizes, "still_learnable", lambda _multi_start, found: found.error)
    return SimpleNamespace(
        network=SimpleNamespace(order="auto", hidden="auto"),
        eigenvalues_known=eigenvalues,
        first_order=lambda: shown,
        highest_order=lambda: 20,
        linear=lambda order: SimpleNamespace(error=LINEAR[order]),
    )


@pytest.mark.parametrize(("shown", "first"), [(2, 4), (3, 4), (4, 4), (6, 4), (7, 4), (1, 3)])
def test_search_begins_with_the_fewest_states_that_do_as_well(
    monkeypatch: pytest.MonkeyPatch, shown: int, first: int
) -> None:
    """Of what is shown and two states more: one state too few is not found to be enough."""
    assert orders_to_try(search(monkeypatch, {}, shown))[0] == first


def test_order_of_known_eigenvalues_is_taken_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    assert orders_to_try(search(monkeypatch, {}, 6, eigenvalues=True))[0] == 6


def test_unstable_linear_models_of_many_states_leave_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(LINEAR, 8, math.inf)
    assert orders_to_try(search(monkeypatch, {}, 6))[0] == 4


@pytest.mark.parametrize(("more", "order"), [(0.9e-3, 6), (0.97e-3, 6), (0.99e-3, 4), (2e-3, 4)])
def test_more_states_are_taken_where_units_make_use_of_them(
    monkeypatch: pytest.MonkeyPatch, more: float, order: int
) -> None:
    chosen = choose_sizes(search(monkeypatch, {4: 1e-3, 6: more}))
    assert (chosen.order, chosen.units) == (order, sizes.FIRST_UNITS)
    assert {tried.order for tried in chosen.tried if tried.units} == {4, 6}


def test_known_order_is_not_looked_beyond_by_a_good_network(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chosen = choose_sizes(search(monkeypatch, {4: 1e-3, 6: 1e-4}, eigenvalues=True))
    assert chosen.order == 4
