"""The computing time of a run is counted from its recipe alone."""

from __future__ import annotations

import pytest

from slide_fmu.pipeline.work_estimate import (
    COMPANION,
    CURVE,
    DATA,
    HEAD,
    MEASURING,
    ORDER,
    TRAINING,
    Span,
    estimated_work,
    in_words,
)
from slide_fmu.recipe.quick import QUICK
from slide_fmu.recipe.reading import parse_open_recipe
from tests.recipe.test_quick import OPEN
from tests.recipes import tiny_recipe, tiny_state_space_recipe

SIGNALS = 2, 3
COST = 0.01


def test_open_recipe_has_ranges_and_a_quick_one_takes_less() -> None:
    whole, quick = (parse_open_recipe(OPEN, "it", most) for most in ({}, QUICK))
    both = [estimated_work(one.guess, one.open_keys, COST, SIGNALS) for one in (whole, quick)]
    assert CURVE in both[0]
    assert CURVE not in both[1]
    for stage in (DATA, TRAINING, COMPANION, HEAD, MEASURING):
        assert both[1][stage].high < both[0][stage].high, stage
    assert both[0][TRAINING].high > 4 * both[0][TRAINING].low
    assert list(both[0]) == sorted(both[0], key=ORDER.index) or set(both[0]) <= set(ORDER)


def test_records_of_many_states_take_the_time_of_their_linear_models_too() -> None:
    """The numbers of segments are known then, whatever they cost."""
    one = parse_open_recipe(OPEN, "it")
    few, many = (
        estimated_work(one.guess, one.open_keys, 0.0, SIGNALS, states)[TRAINING]
        for states in (4, 28)
    )
    assert many.low > few.low  # linear machines need no hidden units
    assert many.high > 10 * few.high
    sizes = {"network": {"order": 4, "hidden": 8}, "data": {"duration": 8.0}}
    known = tiny_state_space_recipe(**sizes)
    both = [estimated_work(known, (), 0.0, SIGNALS, states)[TRAINING] for states in (None, 28)]
    assert both[0] == both[1]


def test_time_follows_trajectories_cost_and_sizes() -> None:
    sizes = {"network": {"order": 4, "hidden": 8}, "bound": {}, "data": {"duration": 8.0}}
    base = estimated_work(tiny_state_space_recipe(**sizes), (), COST, SIGNALS)
    more = tiny_state_space_recipe(**{**sizes, "data": {"duration": 8.0, "train": 40}})
    assert base[TRAINING].high > base[TRAINING].low > 0
    ten = estimated_work(more, (), COST, SIGNALS)
    assert base[TRAINING].high < ten[TRAINING].high < 10 * base[TRAINING].high
    dear = estimated_work(tiny_state_space_recipe(**sizes), (), 10 * COST, SIGNALS)
    assert dear[DATA].high == pytest.approx(10 * base[DATA].high)
    assert dear[TRAINING] == base[TRAINING]
    wide = tiny_state_space_recipe(**{**sizes, "network": {"order": 4, "hidden": 16}})
    assert estimated_work(wide, (), COST, SIGNALS)[TRAINING].high > base[TRAINING].high
    # of very many data, a part is learnt from
    hundred, thousand = (
        estimated_work(
            tiny_state_space_recipe(**{**sizes, "data": {"duration": 8.0, "train": n}}),
            (),
            COST,
            SIGNALS,
        )[TRAINING].high
        for n in (4000, 40000)
    )
    assert thousand < 1.5 * hundred


def test_number_of_trajectories_that_a_recipe_gives_counts_where_they_are_cheap() -> None:
    """Else there are 256, without a learning curve."""
    whole, quick = (parse_open_recipe(OPEN, "it", most) for most in ({}, QUICK))
    found, given = (
        estimated_work(one.guess, one.open_keys, COST / 1000, SIGNALS) for one in (whole, quick)
    )
    assert CURVE not in found
    guess = quick.guess
    few = guess.model_copy(update={"data": guess.data.model_copy(update={"train": 16})})
    fewer = estimated_work(few, quick.open_keys, COST / 1000, SIGNALS)
    assert fewer[TRAINING].high < given[TRAINING].high < found[TRAINING].high


def test_recipe_has_the_stages_of_its_parts() -> None:
    assert set(estimated_work(tiny_recipe(), (), COST, SIGNALS)) == {
        "window",
        DATA,
        TRAINING,
        MEASURING,
    }


@pytest.mark.parametrize(
    ("span", "what", "text"),
    [
        (Span(20.0, 30.0), "", "about 25 s"),
        (Span(100.0, 150.0), "", "about 2 min"),
        (Span(180.0, 540.0), "", "about 3 to 9 min"),
        (Span(3600.0, 36000.0), "", "about 1 to 10 h"),
        (Span(180.0, 200.0), "CPU-minutes", "about 3 CPU-minutes"),
        (Span(30.0, 40.0), "CPU-minutes", "about 0.6 CPU-minutes"),
        (Span(7200.0, 9000.0), "CPU-minutes", "about 2.2 CPU-hours"),
        (Span(0.0, 0.0), "", "about 5 s"),
    ],
)
def test_times_are_written_in_the_unit_in_which_people_wait(
    span: Span, what: str, text: str
) -> None:
    assert in_words(span, what) == text


def test_fit_that_begins_at_known_states_takes_its_own_time() -> None:
    """It has no curve, and its time grows with the states and not with long trajectories."""
    recipe = tiny_state_space_recipe()
    open_keys = ("data.train",)
    few, many = (
        estimated_work(recipe, open_keys, 1.0, SIGNALS, known_states=count) for count in (3, 12)
    )
    searched = estimated_work(recipe, open_keys, 1.0, SIGNALS)
    assert CURVE in searched
    assert CURVE not in few
    assert few[TRAINING].high < many[TRAINING].high
    longer = recipe.model_copy(
        update={"data": recipe.data.model_copy(update={"duration": 50 * recipe.data.duration})}
    )
    assert estimated_work(longer, (), 1.0, SIGNALS, known_states=3)[TRAINING] == few[TRAINING]
