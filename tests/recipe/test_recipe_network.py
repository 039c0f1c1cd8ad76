"""Recipes: the tables about networks and trainings, their defaults and their mistakes."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import pytest

from slide_fmu.core.mistakes import value_text
from slide_fmu.recipe.learning import (
    AdamExpert,
    LeastSquaresExpert,
    LeastSquaresRecipe,
    StateSpaceRecipe,
    TrainingRecipe,
)
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from tests.recipes import ESTIMATOR, TINY, whole_recipe

WITHOUT_LEARNING = TINY[: TINY.index("[network]")]
"""The tiny recipe without tables about learning."""

STATE_SPACE = WITHOUT_LEARNING + '[network]\nfamily = "state_space"\n'
WHOLE_ADAM = '[training]\nmethod = "adam"\nsteps = 1\nbatch = 1\nlearning_rate = 0.1\n'


def mistakes(text: str) -> list[str]:
    """The lines about a recipe that cannot be used, without its name."""
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text, "mine.toml")
    lines = str(caught.value).splitlines()
    assert all(line.startswith("mine.toml: ") and len(line) < 250 for line in lines)
    return [line.removeprefix("mine.toml: ") for line in lines]


@pytest.mark.parametrize("value", ["5", "true", '["state_space"]'])
@pytest.mark.parametrize("more", ["", "[training]\nsteps = 3\nstop = 1\n"])
def test_network_that_is_no_table_gives_one_line(value: str, more: str) -> None:
    (line,) = mistakes(f"network = {value}\n{WITHOUT_LEARNING}{more}")
    found = value_text(tomllib.loads(f"value = {value}")["value"])
    assert line.startswith(f"network = {found}: expected a table of keys and values")


@pytest.mark.parametrize(
    "more",
    [
        "",
        "[network]\nhidden = 4\n",
    ],
)
def test_training_that_is_no_table_gives_one_line(more: str) -> None:
    (line,) = mistakes(f"training = 5\n{WITHOUT_LEARNING}{more}")
    assert line.startswith("training = 5: expected a table of keys and values")


@pytest.mark.parametrize(
    "text",
    [WITHOUT_LEARNING, 'network = "state_space"\n' + WITHOUT_LEARNING, STATE_SPACE],
    ids=["nothing", "short", "table"],
)
def test_recipe_that_says_no_more_is_a_state_space_recipe(text: str) -> None:
    recipe = parse_recipe(text, "mine.toml")
    assert recipe.network == StateSpaceRecipe()
    assert recipe.training == LeastSquaresRecipe()
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


def test_method_follows_the_family() -> None:
    assert parse_recipe(TINY, "mine.toml").training == TrainingRecipe(
        steps=40, batch=32, learning_rate=3e-3, expert=AdamExpert(validate_every=10)
    )
    keys = "hidden = 4\n[training.expert]\npart = 2\neven_out = true\n"
    recipe = parse_recipe(STATE_SPACE + keys, "mine.toml")
    assert recipe.network == StateSpaceRecipe(hidden=4)
    assert recipe.training == LeastSquaresRecipe(expert=LeastSquaresExpert(part=2, even_out=True))
    assert not LeastSquaresExpert().even_out


def test_table_without_family_is_one_of_a_state_space_network() -> None:
    recipe = parse_recipe(WITHOUT_LEARNING + "[network]\nhidden = 4\n", "mine.toml")
    assert recipe.network == StateSpaceRecipe(hidden=4)


def test_trajectories_beyond_the_range_are_for_state_space_networks() -> None:
    with pytest.raises(RecipeError) as caught:
        parse_recipe(TINY.replace("train = 4", "train = 4\nbeyond = 3"), "mine.toml")
    assert str(caught.value) == (
        "mine.toml: data.beyond = 3; expected 0 for network.family = 'feed_forward': "
        "state-space networks alone learn from them"
    )
    recipe = parse_recipe(STATE_SPACE.replace("train = 4", "train = 4\nbeyond = 3"), "mine.toml")
    assert recipe.count("beyond") == 3
    assert recipe.data.beyond_factor == (1.0, 3.0)


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("beyond = -1", "data.beyond = -1: expected at least 0"),
        ("beyond_factor = [3.0, 1.0]", "data.beyond_factor = [3.0, 1.0]: expected two numbers, "),
        ("beyond_factor = [0.0, 1.0]", "1st value of data.beyond_factor = 0.0: expected more"),
        ("beyond_factor = [1.0, inf]", "2nd value of data.beyond_factor = inf: expected a finite"),
    ],
)
def test_mistakes_about_trajectories_beyond_the_range(key: str, line: str) -> None:
    (found,) = mistakes(STATE_SPACE.replace("train = 4", f"train = 4\n{key}"))
    assert found.startswith(line)


GATED = 'units = "gated"\nschedule = ["inputs"]\n'
"""Keys of a state-space network with gated units."""


def test_network_sees_the_inputs_by_default() -> None:
    state_space, feed_forward = (
        parse_recipe(text, "mine.toml").network for text in (WITHOUT_LEARNING, TINY)
    )
    assert isinstance(state_space, StateSpaceRecipe)
    nothing: tuple[str, ...] = ()
    assert state_space.roles() == {
        "drive": ("inputs",), "static": ("inputs",), "gated": nothing,
        "schedule": nothing, "readout": nothing, "turn": nothing,
    }  # fmt: skip
    assert state_space.feature_names() == feed_forward.feature_names() == ("inputs",)


def test_features_of_gated_units_have_roles() -> None:
    keys = 'drive = ["changes"]\nreadout = ["inputs"]\n'
    recipe = parse_recipe(STATE_SPACE + GATED + keys + "turned_pairs = 2\n", "mine.toml")
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe
    network = recipe.network
    assert isinstance(network, StateSpaceRecipe)
    assert network.roles() == {
        "drive": ("changes",), "static": ("changes",), "gated": ("changes",),
        "schedule": ("inputs",), "readout": ("inputs",), "turn": ("frame",),
    }  # fmt: skip
    assert network.feature_names() == ("changes", "inputs", "frame")
    own = 'static = ["rates"]\ngated = ["wrench"]\n'
    other = parse_recipe(STATE_SPACE + GATED + keys + own, "mine.toml").network
    assert isinstance(other, StateSpaceRecipe)
    assert other.roles() == {
        "drive": ("changes",), "static": ("rates",), "gated": ("wrench",),
        "schedule": ("inputs",), "readout": ("inputs",), "turn": (),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ("features = []", "network.features = []: expected at least 1 value"),
        ("features = 2", "network.features = 2: expected a list in brackets"),
        ("differences = 1", "network.differences is not a known key"),
    ],
)
def test_mistakes_about_features_of_feed_forward_networks(keys: str, line: str) -> None:
    (found,) = mistakes(TINY.replace("hidden = []", f"hidden = []\n{keys}"))
    assert found.startswith(line)


METHOD_LINE = "training.method = {!r}; expected {!r} for network.family = {!r}"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            STATE_SPACE + WHOLE_ADAM,
            METHOD_LINE.format("adam", "levenberg_marquardt", "state_space"),
        ),
        (
            TINY[: TINY.index("[training]")] + '[training]\nmethod = "levenberg_marquardt"\n',
            METHOD_LINE.format("levenberg_marquardt", "adam", "feed_forward"),
        ),
        (
            STATE_SPACE + '[training]\nmethod = "adam"\n',
            METHOD_LINE.format("adam", "levenberg_marquardt", "state_space"),
        ),
        (
            WITHOUT_LEARNING + WHOLE_ADAM,
            METHOD_LINE.format("adam", "levenberg_marquardt", "state_space"),
        ),
        (
            STATE_SPACE + '[training]\nmethod = "newton"\n',
            METHOD_LINE.format("newton", "levenberg_marquardt", "state_space"),
        ),
        (STATE_SPACE.replace('"state_space"', '["state_space"]'), "network.family = "),
        (
            STATE_SPACE.replace('"state_space"', '"transformer"') + WHOLE_ADAM,
            "network.family = 'transformer'; expected one of 'feed_forward', 'state_space'",
        ),
    ],
)
def test_method_that_does_not_suit_the_family_gives_one_line(text: str, line: str) -> None:
    (found,) = mistakes(text)
    assert found.startswith(line)


@pytest.mark.parametrize(
    ("more", "pattern"),
    [
        ("ordr = 3", r"network\.ordr is not a known key"),
        ("[training]\nsteps = 3", r"training\.steps is not a known key"),
        ("[stability]\ngrowht = 3", r"stability\.growht is not a known key"),
        ("order = 0", r"network\.order = 0: expected a whole number from 1, or 'auto'"),
        ('order = "some"', r"network\.order = 'some': expected a whole number from 1, or 'auto'"),
        ("hidden = true", r"network\.hidden = true: expected a whole number from 0, or 'auto'"),
        ("hidden = -1", r"network\.hidden = -1: expected a whole number from 0, or 'auto'"),
        ("differences = 2", r"network\.differences is not a known key"),
        (
            'units = "relu"',
            r"network\.units = 'relu': expected 'tanh', 'cubic', .* or 'auto'",
        ),
        ("drive = []", r"network\.drive = \[\]: expected at least 1 value"),
        ("static = []", r"network\.static = \[\]: expected at least 1 value"),
        ('drive = "inputs"', r"network\.drive = 'inputs': expected a list in brackets"),
        (GATED + "gated = []", r"network\.gated = \[\]: expected at least 1 value"),
        (GATED + "turned_pairs = -1", r"network\.turned_pairs = -1: expected at least"),
        (
            'units = "gated"',
            r"network: units = 'gated' with schedule = \[\]; expected a schedule for gated units, "
            "and for them alone$",
        ),
        (
            'schedule = ["inputs"]',
            r"network: units = 'tanh' with schedule = \['inputs'\]; expected a schedule for gated",
        ),
        (
            'units = "cubic"\nturned_pairs = 1',
            r"network: units = 'cubic' with gated = None, turned_pairs = 1; expected neither "
            "without gated units$",
        ),
        (
            'gated = ["inputs"]',
            r"network: units = 'tanh' with gated = \['inputs'\], turned_pairs = 0; expected",
        ),
        (GATED + "bias = false", r"network: bias = false with gated units; expected true$"),
        (GATED + "substeps = 2", r"network: substeps = 2 with gated units; expected 1$"),
        (
            'bias = false\ndrive = ["changes", "turn"]',
            r"network: bias = false with the features \['changes', 'turn'\]; expected true, or "
            "features out of inputs, changes, second_changes without a readout: only then",
        ),
        (
            'bias = false\nreadout = ["inputs"]',
            r"network: bias = false with the features \['inputs'\] and readout = \['inputs'\]; ",
        ),
        ("[training.expert]\neven_out = 2", r"training\.expert\.even_out = 2: expected true or"),
        ("[training.expert]\npart = 0", r"training\.expert\.part = 0: expected more than 0"),
        ("[stability]\namplitudes = []", r"stability.amplitudes = \[\]: "),
        (
            "[stability]\namplitudes = [1, 0]",
            r"2nd value of stability.amplitudes = 0: expected more",
        ),
        ("[training.expert]\nbeyond_weight = 0", r"training\.expert\.beyond_weight = 0: exp"),
        (
            "[stability]\ncontraction_beyond = inf",
            r"stability.contraction_beyond = inf: expected a finite number",
        ),
    ],
)
def test_mistakes_about_state_space_networks_name_key_and_value(more: str, pattern: str) -> None:
    (line,) = mistakes(STATE_SPACE + more)
    assert re.match(pattern, line)


@pytest.mark.parametrize(
    ("table", "samples"),
    [
        ({"family": "state_space"}, 41),
        ({"family": "feed_forward", "hidden": [], "time_invariant": True}, 41),
        ({"family": "feed_forward", "hidden": [], "time_invariant": False}, 48),
    ],
)
@pytest.mark.parametrize("estimator", [False, True])
def test_shortest_validation_counts_the_inputs_that_a_network_sees(
    table: dict[str, Any], samples: int, estimator: bool
) -> None:
    """n_in = 48, n_out = 8: without a burn-in the first scored sample has seen what it needs."""
    tables = tomllib.loads(TINY)
    tables["network"] = table
    if table["family"] == "state_space":
        del tables["training"]
    counts = {"estimator": 1, "estimator_validation": 1} if estimator else {}
    tables["data"] = {**tables["data"], **counts, "burn_in": 0.0}
    if estimator:
        tables["estimator"] = ESTIMATOR
    recipe = whole_recipe(tables)
    scored = 8 if estimator else 1
    expected = (samples + scored - 1) * recipe.window.step
    assert recipe.shortest_validation() == pytest.approx(expected)
    burnt = tables["data"] | {"burn_in": 10 * recipe.window.step}
    later = whole_recipe(tables | {"data": burnt}).shortest_validation()
    assert later == pytest.approx(expected - 10 * recipe.window.step)


def test_all_trainings_are_those_of_surrogate_and_estimator() -> None:
    tables = tomllib.loads(STATE_SPACE)
    tables["data"] |= {"estimator": 1, "estimator_validation": 1}
    recipe = whole_recipe(tables | {"estimator": ESTIMATOR})
    assert recipe.estimator is not None
    assert recipe.trainings() == (LeastSquaresRecipe(), recipe.estimator.training)


def test_without_biases_a_feed_forward_network_sees_what_changes_its_sign() -> None:
    features = 'bias = false\nfeatures = ["{}"]'
    parse_recipe(TINY.replace("bias = false", features.format("changes")), "mine.toml")
    (line,) = mistakes(TINY.replace("bias = false", features.format("direction")))
    assert line.startswith("network: bias = false with the features ['direction']; expected true")
