"""The search for inputs whose error is large relative to its bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.readable import ratio_text
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.trust_sections import search_sections
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import RandomStates, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation import adversarial
from slide_fmu.validation.adversarial import Attack, Target, attack, search
from tests.bounded import bounded_surrogate, with_tolerances
from tests.fmu.samples import CellShape, Shape
from tests.progress import silent
from tests.recipes import tiny_state_space_recipe
from tests.refusals import refused

RECIPE = tiny_state_space_recipe(bound={}, data={"duration": 4.0}, validation={"adversarial": 2})


def surrogate_of(recipe: Recipe, limit: float, window: tuple[int, int] = (9, 4)) -> Surrogate:
    """A surrogate that has learnt nothing, with bounds that follow from nothing."""
    system = case_of(recipe).system
    found = with_tolerances(
        bounded_surrogate(Shape(*window, cell=CellShape(contraction=0.9))), 1e9
    )
    assert found.bound is not None
    bound = replace(found.bound, limits=np.full(found.bound.limits.shape, limit))
    high = system.inputs[0].high
    return replace(
        found,
        window=Window(recipe.window.step, *window),
        inputs=system.inputs,
        outputs=system.outputs,
        input_scaling=Affine.of_channels([0.0], [high]),
        bound=bound,
    )


@pytest.fixture(scope="module")
def attacks() -> list[Attack]:
    return attack(surrogate_of(RECIPE, 1e9), case_of(RECIPE), 3, 2, silent)


@pytest.mark.extended
def test_search_makes_errors_larger_relative_to_their_bounds(attacks: list[Attack]) -> None:
    assert all(found.after > found.before > 0 for found in attacks)


def test_inputs_that_are_found_lie_in_their_ranges_and_have_the_error(
    attacks: list[Attack],
) -> None:
    (signal,) = case_of(RECIPE).system.inputs
    for one in attacks:
        found = one.measured
        assert signal.low <= found.inputs.min() < found.inputs.max() <= signal.high
        ratio = found.errors / found.bounds
        assert ratio[found.step].max() == pytest.approx(one.after)
        assert found.trusted[found.step]


@pytest.mark.extended
def test_same_seed_finds_the_same(attacks: list[Attack]) -> None:
    (again, _) = attack(surrogate_of(RECIPE, 1e9), case_of(RECIPE), 3, 2, silent)
    assert np.array_equal(again.measured.inputs, attacks[0].measured.inputs)


LONGER = RECIPE.model_copy(update={"data": RECIPE.data.model_copy(update={"duration": 8.0})})
"""Its trajectories are many times as long as what a change is remembered."""


def searched(goes_on: bool, system: System) -> Attack:
    drawn = draw(LONGER, system, Stream(TEST, 5, (1.0, 1.0), 8.0), 0)
    target = Target(surrogate_of(LONGER, 1e9, (48, 8)), system, drawn, goes_on)
    return search(target, np.random.default_rng(4))


@pytest.mark.extended
def test_search_that_goes_on_from_changes_finds_what_one_of_whole_records_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    system = case_of(LONGER).system
    assert isinstance(system, RandomStates)
    steps: list[int] = []
    advance = system.advance

    def counted(inputs: FloatArray) -> FloatArray:
        steps.append(1)
        return advance(inputs)

    monkeypatch.setattr(system, "advance", counted)
    monkeypatch.setattr(adversarial, "CHILDREN", 20)
    found = searched(True, system)
    fewer, _ = len(steps), steps.clear()
    whole = searched(False, system)
    assert len(steps) == (20 + 2) * len(whole.measured.inputs)
    assert fewer < 0.4 * len(steps)
    assert np.array_equal(found.measured.inputs, whole.measured.inputs)
    assert found.after == whole.after > whole.before
    assert found.measured.step == whole.measured.step


def test_changes_on_which_the_reference_fails_are_not_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    system = case_of(LONGER).system
    assert isinstance(system, RandomStates)
    count = [0]
    advance, length = system.advance, round(8.0 / LONGER.window.step)

    def failing(inputs: FloatArray) -> FloatArray:
        count[0] += 1
        if length + 100 < count[0] < length + 150:  # half of the changes end at once
            raise SimulationError("the solver did not converge")
        return advance(inputs)

    monkeypatch.setattr(system, "advance", failing)
    monkeypatch.setattr(adversarial, "CHILDREN", 60)
    found = searched(True, system)
    assert found.after >= found.before > 0


def test_system_without_states_simulates_whole_records() -> None:
    drawn = draw(LONGER, case_of(LONGER).system, Stream(TEST, 5, (1.0, 1.0), 8.0), 0)
    target = Target(
        surrogate_of(LONGER, 1e9), Sum(case_of(LONGER).system), replace(drawn, initial=None)
    )
    parent = target.run(drawn.inputs)
    assert parent.states == ()
    changed = drawn.inputs.copy()
    changed[40:50] = 0.0
    child = target.run_changed(parent, changed, slice(40, 50))
    np.testing.assert_array_equal(child.outputs, np.cumsum(np.pad(changed, ((1, 0), (0, 0))), 0))


class Sum(System):
    """Its output is the sum of all inputs so far; it has no state that could be set."""

    def __init__(self, like: System) -> None:
        self.step, self.inputs, self.outputs = like.step, like.inputs, like.outputs

    def simulate(self, inputs: FloatArray) -> FloatArray:
        return np.cumsum(np.pad(inputs, ((1, 0), (0, 0))), axis=0)


def test_errors_outside_of_the_domain_do_not_count() -> None:
    found = attack(surrogate_of(RECIPE, 1e-20), case_of(RECIPE), 3, 1, silent)
    assert [(one.before, one.after) for one in found] == [(0.0, 0.0)]


def test_errors_that_are_not_trusted_do_not_count() -> None:
    surrogate = with_tolerances(surrogate_of(RECIPE, 1e9), 1e-9)
    found = attack(surrogate, case_of(RECIPE), 3, 1, silent)
    assert [(one.before, one.after) for one in found] == [(0.0, 0.0)]


def test_section_shows_the_worst(attacks: list[Attack]) -> None:
    surrogate = surrogate_of(RECIPE, 1e9)
    assert search_sections([], surrogate) == []
    (section,) = search_sections(attacks, surrogate)
    worst = max(found.after for found in attacks)
    (chart,) = section.charts
    assert f"{ratio_text(worst)} times its bound" in chart.title


def test_search_without_a_bound_is_refused() -> None:
    with refused(ValueError, "validation.adversarial = 2", "2 without a", "[bound"):
        tiny_state_space_recipe(validation={"adversarial": 2})


def test_held_out_kind_that_is_learnt_from_is_refused() -> None:
    kind = {"kind": "held_random", "weight": 3.0}
    with refused(ValueError, "'held_random' that is", "data.excitation too"):
        tiny_state_space_recipe(data={"excitation": [kind]}, validation={"excitation": [kind]})


def test_recipe_with_held_out_kinds_draws_them() -> None:
    held_out = {"kind": "binary", "weight": 1.0, "duration": [0.1, 0.3]}
    recipe = tiny_state_space_recipe(validation={"excitation": [held_out]})
    assert [kind.kind for kind in recipe.with_held_out_kinds().data.excitation] == ["binary"]
    with refused(ValueError, "of excitation"):
        tiny_state_space_recipe().with_held_out_kinds()
