"""Orders that a search begins and ends with where no eigenvalues are known; nothing is fitted."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from slide_fmu.fitting.state_space import sizes
from slide_fmu.fitting.state_space.fit import ROUND, compete
from slide_fmu.fitting.state_space.sizes import SizeChoice, choose_sizes, orders_to_try
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

LINEAR = {1: 0.5, 2: 0.2, 3: 0.15, 4: 0.1, 5: 0.1, 6: 0.0999, 7: 0.0999, 8: 0.0999, 9: 0.3}
"""Errors of linear models by their orders: four states do as well as more."""


def search(
    monkeypatch: pytest.MonkeyPatch,
    with_units: dict[int, float],
    shown: int = 4,
    eigenvalues: bool = False,
    blocks: Callable[[Any], tuple[float, ...]] | None = None,
) -> Any:
    """A multi-start whose networks have errors by their orders, with any number of units.

    Those of measured records have errors of blocks by their shape.
    """

    def judge(_multi_start: Any, order: int, units: int) -> Any:
        error = with_units.get(order, 1.0) if units else LINEAR[order]
        shape = SimpleNamespace(n_units=units, n_parameters=order)
        state = SimpleNamespace(best=None)
        return SimpleNamespace(error=error, training_error=error, shape=shape, state=state)

    monkeypatch.setattr(sizes, "judge", judge)
    monkeypatch.setattr(sizes, "noise_in", lambda _found, _validation: 0.0)
    monkeypatch.setattr(sizes, "still_learnable", lambda _data, found: found.error)
    return SimpleNamespace(
        network=SimpleNamespace(order="auto", hidden="auto"),
        data=SimpleNamespace(
            validation=None,
            part=SimpleNamespace(targets=torch.zeros(9000)),
            problem=SimpleNamespace(measured=blocks is not None),
            errors_of_blocks=lambda shape, _theta: blocks and blocks(shape),
        ),
        eigenvalues_known=eigenvalues,
        first_order=lambda: shown,
        highest_order=lambda: 20,
        linear=lambda order: SimpleNamespace(error=LINEAR[order]),
        ledger=SimpleNamespace(plan=lambda _iterations, _part: None),
    )


def test_size_that_is_good_on_one_block_of_a_record_alone_is_not_chosen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Six states are lucky on one block of five, which the whole error shows and no median."""

    def blocks(shape: Any) -> tuple[float, ...]:
        error = LINEAR[shape.n_parameters] if shape.n_units == 0 else 0.05
        lucky = 0.3 if shape.n_units and shape.n_parameters > 4 else 1.0
        return (lucky * error, error, error, 1.1 * error, 1.2 * error)

    errors = {4: 0.05, 6: 0.02, 8: 0.05}
    assert choose_sizes(search(monkeypatch, errors)).order == 6
    chosen = choose_sizes(search(monkeypatch, errors, blocks=blocks))
    assert chosen.order == 4
    tried = {(one.order, one.units): one for one in chosen.tried}
    six = tried[6, 16]
    assert six.validation_error == pytest.approx(0.05)
    assert (six.lowest_error, six.highest_error) == pytest.approx((0.015, 0.06))


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


def test_network_of_more_states_is_offered_beside_a_guessed_order(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chosen = choose_sizes(search(monkeypatch, {4: 1e-3, 6: 2e-3}))
    assert (chosen.order, chosen.n_units) == (4, sizes.FIRST_UNITS)
    assert chosen.larger is not None
    assert chosen.larger.error == 2e-3
    assert {tried.order for tried in chosen.tried if tried.units} == {4, 6}


def test_known_order_has_no_other_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = choose_sizes(search(monkeypatch, {4: 1e-3, 6: 1e-4}, eigenvalues=True))
    assert chosen.order == 4
    assert chosen.larger is None


@pytest.mark.parametrize(("two", "four", "order"), [(1e-3, 1e-2, 2), (1e-2, 1e-3, 4)])
def test_linear_models_of_more_states_do_not_raise_a_known_order(
    monkeypatch: pytest.MonkeyPatch, two: float, four: float, order: int
) -> None:
    """Twice the states halve the error of the linear model; with units the smaller one counts."""
    chosen = choose_sizes(search(monkeypatch, {2: two, 4: four}, 2, eigenvalues=True))
    assert (chosen.order, chosen.n_units) == (order, sizes.FIRST_UNITS)


def shape_of(order: int, units: int) -> Any:
    return SimpleNamespace(n_units=units, n_states=order)


def sized(order: int, error: float = 1.0) -> Any:
    """A network with so many states."""
    return SimpleNamespace(shape=shape_of(order, 16), error=error)


class Runs:
    """The last runs of a fit: each lowers an error to a part of itself, by the states."""

    def __init__(self, first: dict[int, float], again: list[float], iterations: int = 60) -> None:
        self.training = LeastSquaresRecipe(iterations=iterations)
        self.ledger = SimpleNamespace(plan=lambda iterations: None)
        self.network = StateSpaceRecipe(family="state_space", order="auto", hidden="auto")
        self.told: list[Any] = []
        self.problem = SimpleNamespace(sized=lambda table: self.told.append(table.order))
        self.first, self.again = first, iter(again)
        self.done: list[tuple[int, str, int | None]] = []

    def shape(self, order: int, units: int) -> Any:
        return shape_of(order, units)

    def dense_units(self, order: int, units: int) -> int:
        return units

    def refine(
        self, candidate: Any, name: str = "", iterations: int | None = None, afresh: bool = True
    ) -> Any:
        states = candidate.shape.n_states
        self.done.append((states, name, iterations))
        gain = self.first[states] if afresh else next(self.again)
        return SimpleNamespace(shape=candidate.shape, error=gain * candidate.error)

    def compete(self, larger: float = 1.0) -> Any:
        """Let four states with the error 1 compete with six."""
        return compete(self, SizeChoice(4, 16, sized(4), sized(6, larger)))  # type: ignore[arg-type]


@pytest.mark.parametrize(("more", "states"), [(0.9, 6), (0.97, 6), (0.99, 4), (2.0, 4)])
def test_more_states_are_taken_where_they_do_better_in_the_end(more: float, states: int) -> None:
    """Refined errors decide: relative to that of the guessed order."""
    runs = Runs({4: 1.0, 6: more}, [1.0, 1.0])
    assert runs.compete().shape.n_states == states
    assert [iterations for _, _, iterations in runs.done] == [ROUND] * len(runs.done)


@pytest.mark.parametrize(
    ("gains", "iterations", "rounds"),
    [([0.5, 1.0, 0.5], 60, [20, 20]), ([0.9, 0.9], 60, [20, 20]), ([0.9, 0.9], 50, [20, 10])],
)
def test_better_network_goes_on_while_it_pays(
    gains: list[float], iterations: int, rounds: list[int]
) -> None:
    runs = Runs({4: 1.0, 6: 1.0}, gains, iterations)
    found = runs.compete()
    names = [f"refined, again {number}" for number in range(1, len(rounds) + 1)]
    assert runs.done[2:] == [(4, *pair) for pair in zip(names, rounds, strict=True)]
    assert found.error == pytest.approx(math.prod(gains[: len(rounds)]))


@pytest.mark.parametrize(("gain", "states"), [(0.8, 6), (0.9, 4)])
def test_network_of_more_states_goes_on_where_it_may_still_win(gain: float, states: int) -> None:
    """It begins with twice the error; every round helps as much as the first one."""
    runs = Runs({4: 1.0, 6: gain}, [1.0] + 4 * [gain], 5 * ROUND)
    assert runs.compete(2.0).shape.n_states == states
    assert [done for done, _, _ in runs.done[2:]] == ([4, 6, 6, 6, 6] if states == 6 else [4])


def test_network_that_uses_more_states_already_is_refined_alone() -> None:
    runs = Runs({6: 1.0}, [])
    assert runs.compete(0.9).shape.n_states == 6
    assert len(runs.done) == 1
    assert runs.told == [6 - runs.network.padding]  # whoever waits for the sizes can begin


def test_many_states_are_found_by_few_linear_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 28 states that are shown, and two more, not each order is fitted."""
    for order in range(10, 31):
        monkeypatch.setitem(LINEAR, order, 0.01 if order >= 26 else 0.05)
    fitted, one = list[int](), search(monkeypatch, {}, 28)
    linear = one.linear
    one.linear = lambda order: fitted.append(order) or linear(order)
    assert orders_to_try(one)[0] == 26
    assert len(set(fitted)) <= 8
