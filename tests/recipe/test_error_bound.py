"""The recipe's table ``bound``."""

from __future__ import annotations

from typing import Any

import pytest

from slide_fmu.pipeline.case_checks import check_case
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.learning import LeastSquaresRecipe
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import OF_BOUND, SPLITS, Recipe, RecipeError
from tests.recipes import tiny_recipe, tiny_state_space_recipe
from tests.refusals import refused

AUTOMATIC = """
name = "mine"
description = "a lag"
system = { model = "lag.py", kind = "function" }
window = { step = 0.1 }
"""
LONG = {"duration": 4.0}
"""Trajectories as long as a bound needs."""


def test_bound_has_trajectories_of_its_own() -> None:
    recipe = tiny_state_space_recipe(bound={}, data=LONG)
    assert [recipe.count(split) for split in OF_BOUND] == [recipe.data.train, 100, 200, 0]
    other = tiny_state_space_recipe(bound={}, data={"companion": 3, "bound": 7, **LONG})
    assert [other.count(split) for split in OF_BOUND] == [3, 7, 200, 0]


def test_companion_may_learn_from_the_trajectories_of_the_surrogate() -> None:
    recipe = tiny_state_space_recipe(bound={}, data={"companion": "train", **LONG})
    assert recipe.count("companion") == 0


@pytest.mark.parametrize(
    ("data", "open_keys"),
    [
        ("", {"companion", "bound", "calibration"}),
        ("bound = 40", {"companion", "calibration"}),
        ("train = 5", set()),
        ('train = 5\ncalibration = "auto"', {"calibration"}),
    ],
)
def test_numbers_of_a_bound_are_found_where_those_of_the_surrogate_are(
    data: str, open_keys: set[str]
) -> None:
    recipe = parse_open_recipe(f"{AUTOMATIC}[data]\n{data}\n[bound]\n", "mine.toml")
    of_bound = {"data.companion", "data.bound", "data.calibration"}
    assert {key.removeprefix("data.") for key in of_bound & {*recipe.open_keys}} == open_keys
    without = parse_open_recipe(f"{AUTOMATIC}[data]\n", "mine.toml")
    assert not of_bound & {*without.open_keys}


def test_recipe_without_a_bound_makes_no_trajectories_for_it() -> None:
    recipe = tiny_state_space_recipe(data={"bound": 7})
    assert [recipe.count(split) for split in OF_BOUND] == [0, 0, 0, 0]


SWITCHED = {"kind": "binary", "weight": 1.0, "duration": [0.1, 0.3]}
"""A kind of excitation that the tiny recipe does not train on."""


def test_further_kinds_have_trajectories_of_their_own() -> None:
    table = {"excitation": [SWITCHED]}
    recipe = tiny_state_space_recipe(bound=table, data={"bound": 7, **LONG})
    assert recipe.count("further") == 3
    five = {**table, "expert": {"further": 5}}
    other = tiny_state_space_recipe(bound=five, data={"bound": 7, **LONG})
    assert other.count("further") == 5
    for split in SPLITS:
        kinds = [kind.kind for kind in recipe.drawn_for(split).data.excitation]
        assert (kinds == ["binary"]) == (split == "further")


def test_one_further_trajectory_is_never_the_default() -> None:
    table = {"excitation": [SWITCHED]}
    assert tiny_state_space_recipe(bound=table, data={"bound": 2, **LONG}).count("further") == 2


def test_kinds_of_the_training_are_drawn_where_something_is_learnt() -> None:
    """Nothing is calibrated by them, and no network is chosen by them."""
    expert = {"expert": {"excitation": [SWITCHED]}}
    recipe = tiny_state_space_recipe(bound={}, training=expert, data=LONG)
    for split in set(SPLITS) - {"further"}:
        kinds = [kind.kind for kind in recipe.drawn_for(split).data.excitation]
        assert ("binary" in kinds) == (split in ("train", "companion", "bound"))
    assert "binary" not in [kind.kind for kind in recipe.data.excitation]
    with refused(ValueError, "'binary' that is", "training.expert.excitation has"):
        tiny_state_space_recipe(bound={}, training=expert, data={"excitation": [SWITCHED], **LONG})


@pytest.mark.parametrize("table", ["validation", "bound"])
def test_inputs_that_move_alone_need_another_kind_in_their_table(table: str) -> None:
    alone = {"kind": "one_at_a_time", "weight": 1.0}
    sine = {"kind": "harmonic", "weight": 1.0, "angular_frequency": [1.0, 2.0]}

    def recipe(*kinds: dict[str, object]) -> Recipe:
        tables = {"bound": {}, table: {"excitation": list(kinds)}}
        return tiny_state_space_recipe(**tables, data=LONG)

    assert [kind.kind for kind in recipe(alone, sine).tables_of_kinds()[table]] == [
        "one_at_a_time",
        "harmonic",
    ]
    with refused(ValueError, f"{table}.excitation has the kind 'one_at_a_time' only", "add one"):
        recipe(alone)
    of_sine = {**alone, "moves_as": "harmonic"}
    assert recipe(of_sine, sine)
    of_noise = {**alone, "moves_as": "noise"}
    with refused(ValueError, "moves_as = 'noise'", "this table, ['harmonic']", "leave moves_as"):
        recipe(of_noise, sine)


def test_inputs_may_move_alone_as_the_kinds_of_several_tables() -> None:
    alone = {"kind": "one_at_a_time", "weight": 1.0}
    sine = {"kind": "harmonic", "weight": 1.0, "angular_frequency": [1.0, 2.0]}
    recipe = tiny_state_space_recipe(
        bound={"excitation": [alone, sine]},
        data={"excitation": [alone, SWITCHED], **LONG},
    )
    assert recipe.further_kinds()[0] == recipe.data.excitation[0]


def test_recipe_without_further_kinds_draws_none() -> None:
    recipe = tiny_state_space_recipe(bound={}, data=LONG)
    assert recipe.count("further") == 0
    with refused(RecipeError, "expected some under [[bound.excitation]]"):
        recipe.with_further_kinds()


@pytest.mark.parametrize("table", ["data", "training.expert", "bound", "validation"])
def test_kind_that_cannot_drive_the_inputs_is_refused_before_anything_is_made(
    table: str,
) -> None:
    turned = {"kind": "speed_ramps", "weight": 1.0, "speed": 8.0, "acceleration": 20.0}
    values: dict[str, Any] = {"data": LONG, "bound": {}, "validation": {}, "training": {}}
    name, *expert = table.split(".")
    kinds = {"excitation": [SWITCHED, turned]}
    values[name] = {**values[name], **({"expert": kinds} if expert else kinds)}
    recipe = tiny_state_space_recipe(**values)
    with pytest.raises(
        RecipeError, match=rf"2nd \[\[{table}.excitation\]\]: kind = 'speed_ramps'"
    ):
        check_case(case_of(recipe))


def test_companion_is_fitted_as_the_surrogate_but_for_its_seed() -> None:
    recipe = tiny_state_space_recipe(bound={"expert": {"seed": 5}}, data=LONG)
    other = recipe.of_companion(2)
    assert other.training.seed == recipe.training.seed + 5 + 1 + 2
    seed = {"seed": recipe.training.seed}
    same = other.model_copy(update={"training": other.training.model_copy(update=seed)})
    assert same == recipe


def test_companion_has_its_own_size_and_training_where_the_recipe_says_so() -> None:
    own = {"hidden": 9, "iterations": 7, "refinements": 3}
    recipe = tiny_state_space_recipe(bound={"expert": {"companion": own}}, data=LONG)
    other = recipe.of_companion(0)
    assert isinstance(other.training, LeastSquaresRecipe)
    found = other.network.hidden, other.training.iterations, other.training.expert.refinements
    assert found == (9, 7, 3)
    assert recipe.network.hidden != 9


@pytest.mark.parametrize(("seconds", "block", "samples"), [(0.5, 4, 34), (1e-9, 1, 9)])
def test_estimate_is_over_about_its_span(seconds: float, block: int, samples: int) -> None:
    recipe = tiny_state_space_recipe(bound={"estimate_span": seconds}, data=LONG)
    bound, step = recipe.bound, recipe.window.step
    assert bound is not None
    assert (bound.span_block(step), bound.span_length(step)) == (block, samples)
    assert abs(samples * step - seconds) <= 9 * step
    assert BoundRecipe().span_length(step) == 0


@pytest.mark.parametrize("seconds", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("window", [(40, 30), (128, 100), (200, 180)])
def test_shortest_trajectories_hold_a_mean_over_the_span_behind_what_must_be_known(
    window: tuple[int, int], seconds: float
) -> None:
    """As ``slide_fmu.bounds.error_bound`` takes them: 9 blocks behind what a bound must know."""
    n_in, n_out = window
    recipe = tiny_state_space_recipe(
        window={"n_in": n_in, "n_out": n_out},
        bound={"estimate_span": seconds, "expert": {"short_span": 0.1, "long_span": 0.1}},
        data={"duration": 12.0},
    )
    assert recipe.bound is not None
    block = recipe.bound.span_block(recipe.window.step)
    assert block is not None
    alone = recipe.bound.model_copy(update={"estimate_span": None})
    known = max(n_in, alone.filling(recipe.window))
    assert recipe.bound.samples(recipe.window) - known > 9 * block


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"data": {"calibration": 19, **LONG}}, "calibration"),
        ({"data": {"companion": "validation", **LONG}}, "companion"),
        ({"bound": {"expert": {"hidden": []}}}, "hidden"),
        ({"bound": {"expert": {"companion": {"hidden": 0}}}}, r"companion.hidden"),
        ({"bound": {"expert": {"companion": {"units": "tanh"}}}}, "units"),
        (
            {"bound": {"expert": {"long_span": 100.0}}},
            r"data.duration = 4 s; expected at least .* and bound.expert.long_span = 100 s",
        ),
        ({"data": {"duration": 2.0}}, "data.duration = 2 s; expected at least 2.76562 s"),
        (
            {
                "training": {"start": "old.fmu"},
                "bound": {"expert": {"companion": {"hidden": 9}}},
            },
            "companion.hidden = 9 with training.start = 'old.fmu'; expected none",
        ),
        (
            {"bound": {"estimate_span": 100.0}},
            r"data.duration = 4 s; expected at least .* and bound.estimate_span = 100 s",
        ),
        (
            {"bound": {"estimate_span": 1.0}, "estimator": {}},
            r"bound.estimate_span = 1 s together with a table \[estimator\]; expected one",
        ),
        ({"bound": {"estimate_span": 0.0}}, "estimate_span"),
        (
            {"bound": {"expert": {"short_span": 2.0}}},
            "bound.expert.short_span = 2 s, bound.expert.long_span = 1 s",
        ),
        (
            {
                "bound": {"excitation": [{**SWITCHED, "weight": 3.0}]},
                "data": {"excitation": [SWITCHED], **LONG},
            },
            "bound.excitation has a 'binary' that is in data",
        ),
        (
            {
                "bound": {"excitation": [SWITCHED]},
                "validation": {"excitation": [{**SWITCHED, "weight": 3.0}]},
            },
            "'binary' that is in bound.excitation too",
        ),
        (
            {"bound": {"excitation": [SWITCHED], "expert": {"further": 1}}},
            "bound.expert.further = 1 .* expected at least 2",
        ),
        (
            {"bound": {"expert": {"further": 5}}},
            "bound.expert.further = 5 without kinds .* add them",
        ),
        (
            {"parameters": {"mass": {"range": [1.0, 2.0]}}},
            r"\[bound\] with parameters \['mass'\]; expected none",
        ),
    ],
)
def test_bound_that_cannot_be_learnt_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tiny_state_space_recipe(**{"bound": {}, "data": LONG, **changes})


def test_bound_of_layers_is_refused() -> None:
    with refused(ValueError, "[bound] with network.family = 'feed_forward'"):
        tiny_recipe(bound={})


def test_shortest_validation_has_a_sample_at_which_the_bound_counts() -> None:
    recipe = tiny_state_space_recipe(bound={}, data={"burn_in": 0.0, **LONG})
    window, long_block = recipe.window, 8  # of 1 s, an eighth
    assert window.step == 1 / 64
    filling = window.n_in - window.n_out + 1 + 9 * long_block
    assert recipe.shortest_validation() == filling * window.step
    plain = tiny_state_space_recipe(data={"burn_in": 0.0, **LONG})
    assert plain.shortest_validation() < filling * window.step
