"""Recipes of records say nothing about models, and those of models nothing about records."""

from __future__ import annotations

import pytest

from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.records.rules import shares_of
from tests.own_records import RECIPE
from tests.recipes import tiny_recipe


def test_recipe_of_records_leaves_its_numbers_open_and_has_no_excitation() -> None:
    read = parse_open_recipe(RECIPE, "bench.toml")
    assert read.guess.data.excitation == ()
    assert {"data.train", "data.validation", "data.duration"} <= set(read.open_keys)


def test_shares_follow_from_whether_there_are_an_estimator_and_a_bound() -> None:
    estimator, bound = {"estimator", "estimator_validation"}, {"bound", "calibration"}
    for more, parts in (
        ("", set()),
        ("[estimator]\n", estimator),
        ("[bound]\n", bound),
        ("[estimator]\n[bound]\n", estimator | bound),
    ):
        shares = shares_of(parse_open_recipe(RECIPE + more, "bench.toml").guess)
        assert {part for part, share in shares.items() if share} == {
            *("train", "validation", "test"),
            *parts,
        }
        assert list(shares)[-1] == "test"
        assert sum(shares.values()) == pytest.approx(1.0)


def test_spans_of_a_bound_follow_from_the_step_where_they_are_not_given() -> None:
    expert = "[bound.expert]\nshort_span = 0.5\n"
    for more, short in (("[bound]\n", 0.1), (expert, 0.5)):
        bound = parse_open_recipe(RECIPE + more, "bench.toml").guess.bound
        assert bound is not None
        assert (bound.expert.short_span, bound.expert.long_span) == pytest.approx((short, 1.0))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("[data]\ntrain = 8\n", r"data.train = 8 with system.kind = 'record'; expected none"),
        ("[data]\nbeyond = 4\n", "data.beyond = 4 with system.kind = 'record'"),
        (
            '[[data.excitation]]\nkind = "held_random"\nweight = 1.0\n',
            r"data.excitation = \['held_random'\] with system.kind = 'record'; expected none",
        ),
        (
            "[data]\nshares = { train = 0.7, test = 0.3 }\n",
            r"1 in all; expected positive shares of \['train', 'val",
        ),
        (
            "[data]\nshares = { train = 0.5, validation = 0.2, estimator = 0.1, test = 0.2 }\n",
            "and of nothing else",
        ),
        (
            "[data]\nshares = { train = 0.5, validation = 0.2, test = 0.2 }\n",
            r"0\.9 in all; expected .* 1 in all",
        ),
        (
            "[data]\nshares = { learn = 1.0 }\n",
            r"data\.shares\.learn = 'learn': expected 'train', 'val",
        ),
        ('[data]\nby = "window"\n', "data.by = 'window'"),
        ("[validation]\nduration = 3.0\n", "validation.duration = 3.0 with system.kind"),
    ],
)
def test_what_only_models_have_is_refused_of_records(more: str, message: str) -> None:
    with pytest.raises(RecipeError, match=message) as caught:
        parse_open_recipe(RECIPE + more, "bench.toml")
    assert str(caught.value).startswith("bench.toml: ")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"system": {"further": ["b.csv"]}}, r"system.further = \['b.csv'\] with system.kind"),
        ({"system": {"noise_record": "r.csv"}}, "system.noise_record = 'r.csv' with system.kind"),
        ({"data": {"shares": {"train": 1.0}}}, "data.shares = {'train': 1.0} with system.kind"),
        ({"data": {"by": "record"}}, "data.by = 'record' with system.kind = 'class'"),
        ({"data": {"excitation": []}}, "data.excitation is empty"),
    ],
)
def test_what_only_records_have_is_refused_of_models(
    changes: dict[str, dict[str, object]], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        tiny_recipe(**changes)


def test_noise_record_is_refused_of_networks_that_do_not_weight_residuals_by_it() -> None:
    text = RECIPE.replace('model = "bench.csv"', 'model = "bench.csv"\nnoise_record = "rest.csv"')
    assert parse_open_recipe(text, "bench.toml").guess.system.noise_record == "rest.csv"
    feed_forward = text.split("[network]")[0] + (
        '[network]\nfamily = "feed_forward"\nhidden = [4]\n'
        "[training]\nsteps = 10\nbatch = 8\nlearning_rate = 0.01\n"
    )
    with pytest.raises(RecipeError, match=r"expected network\.family = 'state_space'") as caught:
        parse_open_recipe(feed_forward, "bench.toml")
    assert "system.noise_record = 'rest.csv'" in str(caught.value)
