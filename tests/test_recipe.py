"""Recipes: the ones of the project load, and every mistake gives one clear line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from recipes import ESTIMATOR, TINY, tiny_recipe

from slide_fmu.data.sampling import recipe_system, reference_parameters, system_parameters
from slide_fmu.learning_recipe import LeastSquaresRecipe, StateSpaceRecipe, TrainingRecipe
from slide_fmu.recipe import Recipe, RecipeError, load_recipe, parse_recipe

FAMILIES = "network.family = 'transformer'; expected one of 'feed_forward', 'state_space'"
TRAINING = Path(__file__).parents[1] / "training"


@pytest.mark.parametrize("path", sorted(TRAINING.glob("*.toml")), ids=lambda path: path.stem)
def test_recipe_of_the_project_loads(path: Path) -> None:
    recipe = load_recipe(path)
    assert recipe.name == path.stem
    assert recipe_system(recipe).step == recipe.window.step
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


def test_there_are_recipes() -> None:
    assert {"duffing", "linear"} <= {path.stem for path in TRAINING.glob("*.toml")}


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("n_in = 48", "n_in = 48\nn_inn = 3", "window.n_inn is not a known key"),
        ("[data]", "[date]\nx = 1\n[data]", "date is not a known key"),
        ("n_in = 48\n", "", "window.n_in is missing"),
        ("seed = 7\n", "", "data.seed is missing"),
        ("n_in = 48", 'n_in = "many"', "window.n_in = 'many': Input should be a valid integer"),
        ("n_in = 48", "n_in = 4.5", "window.n_in = 4.5: Input should be a valid integer"),
        ("n_in = 48", "n_in = -48", "window.n_in = -48: Input should be greater than 0"),
        ("step = 0.015625", "step = 0.0", "window.step = 0.0: Input should be greater than 0"),
        ("step = 0.015625", "step = inf", "window.step = inf: Input should be a finite number"),
        ("duration = 2.0", "duration = nan", "data.duration = nan: Input should be "),
        ("n_out = 8", "n_out = 49", "window: n_out = 49; expected at most n_in = 48"),
        ("train = 4", "train = 0", "data.train = 0: Input should be greater than 0"),
        ("steps = 40", "steps = 40\nseed = 4294967296", "training.seed = 4294967296: Input"),
        ('name = "tiny"', 'name = "ti ny"', "name = 'ti ny': String should match"),
        (":LinearOscillator", "/LinearOscillator", "system.model = 'mbs_models.oscillators/Lin"),
        ("hidden = []", "hidden = [8, 0]", "network.hidden.1 = 0: Input should be greater"),
        ('"feed_forward"', '"transformer"', FAMILIES),
        ("weight = 1.0", "weight = 0.0", "data.excitation.0.held_random.weight = 0.0: Input"),
        ("weight = 1.0", "weight = inf", "data.excitation.0.held_random.weight = inf: Input"),
        (
            "weight = 1.0",
            "weight = 1.0\namplitude = [0.5, 0.1]",
            "data.excitation.0.held_random.amplitude = [0.5, 0.1]: expected two numbers, not neg",
        ),
        (
            "weight = 1.0",
            "weight = 1.0\nsamples = [3, 1]",
            "data.excitation.0.held_random.samples = [3, 1]: expected two numbers, the smaller",
        ),
        (
            'kind = "held_random"',
            'kind = "noise"',
            "data.excitation.0.kind = 'noise'; expected one of 'held_random', 'moving_average_ran",
        ),
        ('kind = "held_random"\n', "", "data.excitation.0.kind is missing"),
        (
            '[[data.excitation]]\nkind = "held_random"\nweight = 1.0',
            "excitation = []",
            "data.excitation = []: ",
        ),
    ],
)
def test_each_mistake_gives_one_line_with_key_and_value(old: str, new: str, line: str) -> None:
    text = TINY.replace(old, new, 1)
    assert text != TINY
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text, "mine.toml")
    message = str(caught.value)
    assert message.count("\n") == 0
    assert message.startswith(f"mine.toml: {line}")
    assert len(message) < 250


def test_reference_may_have_parameters_of_its_own() -> None:
    text = TINY.replace("substeps = 6 }", "substeps = 6 }\nreference = { substeps = 48 }")
    recipe = parse_recipe(text, "mine.toml")
    assert recipe.system.reference == {"substeps": 48}
    assert reference_parameters(recipe) == {"damping": 40.0, "substeps": 48, "step": 0.015625}
    assert system_parameters(recipe) == {"damping": 40.0, "substeps": 6, "step": 0.015625}
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe
    assert parse_recipe(TINY, "mine.toml").system.reference == {}
    with pytest.raises(RecipeError, match=r"system\.reference = 48: Input should be a valid dict"):
        parse_recipe(text.replace("{ substeps = 48 }", "48"), "mine.toml")


MOTIONS = """
[[data.excitation]]
kind = "speed_ramps"
weight = 1.0
speed = 8.0
acceleration = 20.0

[[data.excitation]]
kind = "point_to_point"
weight = 2.0
duration = [0.6, 2.0]
ramp = [0.15, 0.5]
speed = [1.4, 1.3]
acceleration = [8.0, 10.0]
dwell = 0.4
"""


def test_motions_are_kinds_of_excitation() -> None:
    recipe = parse_recipe(TINY + MOTIONS, "mine.toml")
    assert [kind.kind for kind in recipe.data.excitation[1:]] == ["speed_ramps", "point_to_point"]
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "ramp = [0.15, 0.5]",
            "ramp = [0.15, 0.6]",
            "data.excitation.2.point_to_point.ramp = [0.15, 0.6]: expected at most 0.5",
        ),
        (
            "dwell = 0.4",
            "keep = 0.7\nsingle = 0.4",
            "data.excitation.2.point_to_point: keep = 0.7, single = 0.4; expected shares of",
        ),
        (
            "acceleration = 20.0\n",
            "",
            "data.excitation.1.speed_ramps.acceleration is missing",
        ),
    ],
)
def test_mistakes_in_motions_give_one_line(old: str, new: str, line: str) -> None:
    with pytest.raises(RecipeError) as caught:
        parse_recipe(TINY + MOTIONS.replace(old, new, 1), "mine.toml")
    assert str(caught.value).startswith(f"mine.toml: {line}")
    assert "\n" not in str(caught.value)


def test_several_mistakes_give_several_lines() -> None:
    text = TINY.replace("n_in = 48\n", "").replace("steps = 40", "steps = 0\nstop = 1")
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text, "mine.toml")
    lines = str(caught.value).splitlines()
    assert sorted(line.split(" ")[1] for line in lines) == [
        "training.steps",
        "training.stop",
        "window.n_in",
    ]


@pytest.mark.parametrize("value", ["5", "true", '["state_space"]'])
@pytest.mark.parametrize("more", ["", "[training]\nsteps = 3\nstop = 1\n"])
def test_network_that_is_no_table_gives_one_line(value: str, more: str) -> None:
    (line,) = mistakes(f"network = {value}\n{WITHOUT_LEARNING}{more}")
    found = tomllib.loads(f"value = {value}")["value"]
    assert line.startswith(f"network = {found!r}: Input should be a valid dictionary")


@pytest.mark.parametrize(
    "more",
    [
        "",
        "[network]\nhidden = 4\n",
    ],
)
def test_training_that_is_no_table_gives_one_line(more: str) -> None:
    (line,) = mistakes(f"training = 5\n{WITHOUT_LEARNING}{more}")
    assert line.startswith("training = 5: Input should be a valid dictionary")


@pytest.mark.parametrize("counts", [{}, {"estimator": 3}, {"estimator_validation": 3}])
def test_estimator_needs_trajectories_of_its_own(counts: dict[str, int]) -> None:
    text = TINY.replace(
        "train = 4", "\n".join(f"{k} = {v}" for k, v in counts.items()) + "\ntrain = 4"
    )
    text += """
[estimator.network]
family = "feed_forward"
hidden = [8]
[estimator.training]
steps = 1
batch = 1
learning_rate = 1.0
"""
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text, "mine.toml")
    numbers = (counts.get("estimator", 0), counts.get("estimator_validation", 0))
    assert str(caught.value) == (
        f"mine.toml: recipe: data.estimator = {numbers[0]}, data.estimator_validation = "
        f"{numbers[1]}; the error estimator needs trajectories of its own, at least one each"
    )


@pytest.mark.parametrize("factors", [(3.0, 1.0), (0.0, 1.0), (1.0, float("inf"))])
def test_amplitude_factors_are_ordered_positive_and_finite(factors: Any) -> None:
    data = {"estimator": 2, "estimator_validation": 1}
    estimator = {**ESTIMATOR, "amplitude_factor": factors}
    with pytest.raises(ValueError, match="amplitude_factor"):
        tiny_recipe(data=data, estimator=estimator)
    tiny_recipe(data=data, estimator={**ESTIMATOR, "amplitude_factor": (1.0, 1.0)})


def test_broken_toml_names_line_and_source() -> None:
    with pytest.raises(RecipeError, match=r"^mine.toml: not valid TOML: .*line 2"):
        parse_recipe("name = 'x'\nstep = =", "mine.toml")


def test_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(RecipeError, match=r"recipe '.*' cannot be read") as caught:
            load_recipe(path)
        assert str(path) in str(caught.value)
    latin = tmp_path / "latin.toml"
    latin.write_bytes("# ü".encode("latin-1"))
    with pytest.raises(RecipeError, match=r"latin.toml' cannot be read"):
        load_recipe(latin)


def test_values_keep_their_types() -> None:
    parameters = tiny_recipe(system={"parameters": {"a": True, "b": 2, "c": 2.0, "d": "2"}})
    again = Recipe.model_validate_json(parameters.model_dump_json())
    for recipe in (parameters, again):
        found = recipe.system.parameters
        kinds = {key: type(found[key]) for key in "abcd"}
        assert kinds == {"a": bool, "b": int, "c": float, "d": str}


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
        steps=40, batch=32, learning_rate=3e-3, validate_every=10
    )
    recipe = parse_recipe(STATE_SPACE + "hidden = 4\n[training]\npart = 2\n", "mine.toml")
    assert recipe.network == StateSpaceRecipe(hidden=4)
    assert recipe.training == LeastSquaresRecipe(part=2)


def test_table_without_family_is_one_of_a_state_space_network() -> None:
    recipe = parse_recipe(WITHOUT_LEARNING + "[network]\nhidden = 4\n", "mine.toml")
    assert recipe.network == StateSpaceRecipe(hidden=4)


def test_trajectories_beyond_the_range_are_for_state_space_networks() -> None:
    with pytest.raises(RecipeError) as caught:
        parse_recipe(TINY.replace("train = 4", "train = 4\nbeyond = 3"), "mine.toml")
    assert str(caught.value) == (
        "mine.toml: recipe: data.beyond = 3; expected 0 for network.family = 'feed_forward': "
        "state-space networks alone learn from them"
    )
    recipe = parse_recipe(STATE_SPACE.replace("train = 4", "train = 4\nbeyond = 3"), "mine.toml")
    assert recipe.data.count("beyond") == 3
    assert recipe.data.beyond_factor == (1.0, 3.0)


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("beyond = -1", "data.beyond = -1: Input should be greater than or equal to 0"),
        ("beyond_factor = [3.0, 1.0]", "data.beyond_factor = [3.0, 1.0]: expected two numbers, "),
        ("beyond_factor = [0.0, 1.0]", "data.beyond_factor.0 = 0.0: Input should be greater"),
        ("beyond_factor = [1.0, inf]", "data.beyond_factor.1 = inf: Input should be a finite"),
    ],
)
def test_mistakes_about_trajectories_beyond_the_range(key: str, line: str) -> None:
    (found,) = mistakes(STATE_SPACE.replace("train = 4", f"train = 4\n{key}"))
    assert found.startswith(line)


GATED = 'units = "gated"\nschedule = ["inputs"]\n'
"""Keys of a state-space network with gated units."""


def test_network_sees_the_inputs_unless_told_otherwise() -> None:
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
        ("features = []", "network.features = []: Tuple should have at least 1 item"),
        ("features = 2", "network.features = 2: Input should be a valid tuple"),
        ("differences = 1", "network.differences is not a known key"),
    ],
)
def test_mistakes_about_features_of_feed_forward_networks(keys: str, line: str) -> None:
    (found,) = mistakes(TINY.replace("hidden = []", f"hidden = []\n{keys}"))
    assert found.startswith(line)


METHOD_LINE = "recipe: training.method = {!r}; expected {!r} for network.family = {!r}"


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
            FAMILIES,
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
        ("hidden = true", r"network\.hidden = True: expected a whole number from 0, or 'auto'"),
        ("hidden = -1", r"network\.hidden = -1: expected a whole number from 0, or 'auto'"),
        ("differences = 2", r"network\.differences is not a known key"),
        ('units = "relu"', r"network\.units = 'relu': Input should be 'tanh', 'cubic' or 'gated'"),
        ("drive = []", r"network\.drive = \[\]: Tuple should have at least 1 item"),
        ("static = []", r"network\.static = \[\]: Tuple should have at least 1 item"),
        ('drive = "inputs"', r"network\.drive = 'inputs': Input should be a valid tuple"),
        (GATED + "gated = []", r"network\.gated = \[\]: Tuple should have at least 1 item"),
        (GATED + "turned_pairs = -1", r"network\.turned_pairs = -1: Input should be greater than"),
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
        (
            'bias = false\ndrive = ["changes", "turn"]',
            r"network: bias = false with the features \['changes', 'turn'\]; expected true, or "
            "features out of inputs, changes, second_changes without a readout: only then",
        ),
        (
            'bias = false\nreadout = ["inputs"]',
            r"network: bias = false with the features \['inputs'\] and readout = \['inputs'\]; ",
        ),
        ("[training]\npart = 0", r"training\.part = 0: Input should be greater than 0"),
        ("[stability]\namplitudes = []", r"stability.amplitudes = \[\]: "),
        ("[stability]\namplitudes = [1, 0]", r"stability.amplitudes.1 = 0: Input should be great"),
        ("[training]\nbeyond_weight = 0", r"training\.beyond_weight = 0: Input should be great"),
        ("[stability]\ngrowth = inf", r"stability.growth = inf: Input should be a finite number"),
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
    recipe = Recipe.model_validate(tables)
    scored = 8 if estimator else 1
    expected = (samples + scored - 1) * recipe.window.step
    assert recipe.shortest_validation() == pytest.approx(expected)
    burnt = tables["data"] | {"burn_in": 10 * recipe.window.step}
    later = Recipe.model_validate(tables | {"data": burnt}).shortest_validation()
    assert later == pytest.approx(expected - 10 * recipe.window.step)


def test_all_trainings_are_those_of_surrogate_and_estimator() -> None:
    tables = tomllib.loads(STATE_SPACE)
    tables["data"] |= {"estimator": 1, "estimator_validation": 1}
    recipe = Recipe.model_validate(tables | {"estimator": ESTIMATOR})
    assert recipe.estimator is not None
    assert recipe.trainings() == (LeastSquaresRecipe(), recipe.estimator.training)


def test_without_biases_a_feed_forward_network_sees_what_changes_its_sign() -> None:
    features = 'bias = false\nfeatures = ["{}"]'
    parse_recipe(TINY.replace("bias = false", features.format("changes")), "mine.toml")
    (line,) = mistakes(TINY.replace("bias = false", features.format("direction")))
    assert line.startswith("network: bias = false with the features ['direction']; expected true")
