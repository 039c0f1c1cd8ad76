"""Recipes: the ones of the project load, and every mistake gives one clear line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_open_recipe, parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from tests.recipes import ESTIMATOR, TINY, tiny_recipe
from tests.refusals import refused

TRAINING = Path(__file__).parents[2] / "training"


@pytest.mark.parametrize("path", sorted(TRAINING.glob("*.toml")), ids=lambda path: path.stem)
def test_recipe_of_the_project_loads(path: Path) -> None:
    recipe = load_open_recipe(path).guess
    assert recipe.name == path.stem
    assert case_of(recipe).system.step == recipe.window.step
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


def test_recipes_of_the_project_are_found() -> None:
    assert {"duffing", "linear"} <= {path.stem for path in TRAINING.glob("*.toml")}


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("n_in = 48", "n_in = 48\nn_inn = 3", "window.n_inn is not a known key"),
        ("[data]", "[date]\nx = 1\n[data]", "date is not a known key"),
        ("step = 0.015625\n", "", "window.step is missing"),
        ("seed = 7\n", 'seed = "auto"\n', "data.seed = 'auto': expected a whole number"),
        ("[system]", "automatic = []\n[system]", "automatic is not a known key"),
        ("n_in = 48", 'n_in = "many"', "window.n_in = 'many': expected a whole number"),
        ("n_in = 48", "n_in = 4.5", "window.n_in = 4.5: expected a whole number"),
        ("n_in = 48", "n_in = -48", "window.n_in = -48: expected more than 0"),
        ("step = 0.015625", "step = 0.0", "window.step = 0.0: expected more than 0"),
        ("step = 0.015625", "step = inf", "window.step = inf: expected a finite number"),
        ("duration = 2.0", "duration = nan", "data.duration = nan: expected a finite number"),
        ("n_out = 8", "n_out = 49", "window: n_out = 49; expected at most n_in = 48"),
        ("train = 4", "train = 0", "data.train = 0: expected more than 0"),
        (
            "steps = 40",
            "steps = 40\nseed = 4294967296",
            "training.seed = 4294967296: expected less than",
        ),
        ('name = "tiny"', 'name = "ti ny"', "name = 'ti ny': expected a letter first"),
        ("hidden = []", "hidden = [8, 0]", "2nd value of network.hidden = 0: expected more"),
        (
            '"feed_forward"',
            '"transformer"',
            "network.family = 'transformer'; expected one of 'feed_forward', 'state_space'",
        ),
        (
            "weight = 1.0",
            "weight = 0.0",
            "1st [[data.excitation]] (held_random), key weight = 0.0: expected more than 0",
        ),
        (
            "weight = 1.0",
            "weight = inf",
            "1st [[data.excitation]] (held_random), key weight = inf: expected a finite number",
        ),
        (
            "weight = 1.0",
            "weight = 1.0\namplitude = [0.5, 0.1]",
            "1st [[data.excitation]] (held_random), key amplitude = [0.5, 0.1]: expected two",
        ),
        (
            "weight = 1.0",
            "weight = 1.0\nsamples = [3, 1]",
            "1st [[data.excitation]] (held_random), key samples = [3, 1]: expected two",
        ),
        (
            'kind = "held_random"',
            'kind = "noise"',
            "1st [[data.excitation]], key kind = 'noise'; expected one of 'held_random', ",
        ),
        ('kind = "held_random"\n', "", "1st [[data.excitation]], key kind is missing"),
        (
            '[[data.excitation]]\nkind = "held_random"\nweight = 1.0',
            "excitation = []",
            "data.excitation is empty; ",
        ),
    ],
)
def test_each_mistake_gives_one_line_with_key_and_value(old: str, new: str, line: str) -> None:
    text = TINY.replace(old, new, 1)
    assert text != TINY
    with pytest.raises(RecipeError) as caught:
        parse_open_recipe(text, "mine.toml")
    message = str(caught.value)
    assert message.count("\n") == 0
    assert message.startswith(f"mine.toml: {line}")
    assert len(message) < 320


def test_reference_may_have_parameters_of_its_own() -> None:
    text = TINY.replace("substeps = 6 }", "substeps = 6 }\nreference = { substeps = 48 }")
    recipe = parse_open_recipe(text, "mine.toml").guess
    assert recipe.system.reference == {"substeps": 48}
    assert case_of(recipe).systems.reference_specification.parameters == {
        "damping": 40.0,
        "substeps": 48,
    }
    assert case_of(recipe).systems.specification.parameters == {"damping": 40.0, "substeps": 6}
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe
    assert parse_open_recipe(TINY, "mine.toml").guess.system.reference == {}
    with refused(RecipeError, "system.reference = 48", "expected a table of"):
        parse_open_recipe(text.replace("{ substeps = 48 }", "48"), "mine.toml")


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
    recipe = parse_open_recipe(TINY + MOTIONS, "mine.toml").guess
    assert [kind.kind for kind in recipe.data.excitation[1:]] == ["speed_ramps", "point_to_point"]
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "ramp = [0.15, 0.5]",
            "ramp = [0.15, 0.6]",
            "3rd [[data.excitation]] (point_to_point), key ramp = [0.15, 0.6]: expected at most",
        ),
        (
            "dwell = 0.4",
            "keep = 0.7\nsingle = 0.4",
            "3rd [[data.excitation]] (point_to_point): keep = 0.7, single = 0.4; expected",
        ),
        (
            "acceleration = 20.0\n",
            "",
            "2nd [[data.excitation]] (speed_ramps), key acceleration is missing",
        ),
    ],
)
def test_mistakes_in_motions_give_one_line(old: str, new: str, line: str) -> None:
    with pytest.raises(RecipeError) as caught:
        parse_open_recipe(TINY + MOTIONS.replace(old, new, 1), "mine.toml")
    assert str(caught.value).startswith(f"mine.toml: {line}")
    assert "\n" not in str(caught.value)


def test_several_mistakes_give_several_lines() -> None:
    text = TINY.replace("step = 0.015625\n", "").replace("steps = 40", "steps = 0\nstop = 1")
    with pytest.raises(RecipeError) as caught:
        parse_open_recipe(text, "mine.toml")
    lines = str(caught.value).splitlines()
    assert sorted(line.split(" ")[1] for line in lines) == [
        "training.steps",
        "training.stop",
        "window.step",
    ]


@pytest.mark.parametrize("counts", [(0, 0), (3, 0), (0, 3)])
def test_estimator_needs_trajectories_of_its_own(counts: tuple[int, int]) -> None:
    given = f"estimator = {counts[0]}\nestimator_validation = {counts[1]}\ntrain = 4"
    text = TINY.replace("train = 4", given)
    text += """
[estimator.network]
family = "feed_forward"
hidden = [8]
[estimator.training]
steps = 1
batch = 1
learning_rate = 1.0
"""
    found = f"data.estimator = {counts[0]}, data.estimator_validation = {counts[1]}"
    with refused(RecipeError, found, "at least one each"):
        parse_open_recipe(text, "mine.toml")


@pytest.mark.parametrize("factors", [(3.0, 1.0), (0.0, 1.0), (1.0, float("inf"))])
def test_amplitude_factors_are_ordered_positive_and_finite(factors: Any) -> None:
    data = {"estimator": 2, "estimator_validation": 1}
    estimator = {**ESTIMATOR, "expert": {"amplitude_factor": factors}}
    with refused(ValueError, "amplitude_factor"):
        tiny_recipe(data=data, estimator=estimator)
    tiny_recipe(data=data, estimator={**ESTIMATOR, "expert": {"amplitude_factor": (1.0, 1.0)}})


def test_broken_toml_names_line_and_source() -> None:
    with refused(RecipeError, "mine.toml: not valid TOML", "line 2"):
        parse_open_recipe("name = 'x'\nstep = =", "mine.toml")


def test_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(RecipeError, match=r"recipe '.*' cannot be read") as caught:
            load_open_recipe(path)
        assert str(path) in str(caught.value)
    latin = tmp_path / "latin.toml"
    latin.write_bytes("# ü".encode("latin-1"))
    with refused(RecipeError, "latin.toml' is no text"):
        load_open_recipe(latin)


def test_values_keep_their_types() -> None:
    parameters = tiny_recipe(system={"parameters": {"a": True, "b": 2, "c": 2.0, "d": "2"}})
    again = Recipe.model_validate_json(parameters.model_dump_json())
    for recipe in (parameters, again):
        found = recipe.system.parameters
        kinds = {key: type(found[key]) for key in "abcd"}
        assert kinds == {"a": bool, "b": int, "c": float, "d": str}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"expert": {"lags": (0, 2, 2)}},
            r"lags = \[0, 2, 2\]; expected ages of samples, 0 the newest, each ",
        ),
        (
            {"expert": {"lags": (0, 41)}},
            r"estimator\.expert\.lags end with 41; expected at most n_in - n_out = 40",
        ),
        ({"expert": {"lags": ()}}, "at least 1 value"),
        ({"expert": {"lags": (-1, 2)}}, "expected at least 0"),
        ({"span": 0}, "expected more than 0"),
        ({"span": 89}, r"data\.duration = 2 s; expected at least 2.015"),
        (
            {"expert": {"pretrained_beyond": False}},
            "with in_range = 0.5 and no pretraining; expected a pretr",
        ),
        ({"span": 9, "network": {"time_invariant": False}}, "network sees the whole window"),
    ],
)
def test_span_and_lags_fit(changes: dict[str, Any], message: str) -> None:
    data = {"estimator": 2, "estimator_validation": 1}
    network = {**ESTIMATOR["network"], "time_invariant": True, **changes.pop("network", {})}
    with pytest.raises(RecipeError, match=message):
        tiny_recipe(data=data, estimator={**ESTIMATOR, "network": network, **changes})
    tiny_recipe(
        data=data,
        estimator={
            **ESTIMATOR,
            "network": {**network, "time_invariant": True},
            "expert": {"lags": (0, 1, 40)},
            "span": 88,
        },
    )


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"data": {"burn_in": 1e12}}, "data.burn_in"),
        ({"data": {"duration": 1e9}}, "data.duration"),
        ({"validation": {"duration": 1e9}}, "validation.duration"),
    ],
)
def test_motions_that_fit_into_no_memory_are_refused(changes: dict[str, Any], key: str) -> None:
    with pytest.raises(ValueError, match=rf"{key} asks for .* expected at most 10,000,000"):
        tiny_recipe(**changes)


def test_name_that_is_too_long_for_a_file_is_refused() -> None:
    assert tiny_recipe(name="x" * 100).name == "x" * 100
    with refused(ValueError, "name"):
        tiny_recipe(name="x" * 101)


def test_empty_table_of_the_estimator_is_a_whole_one() -> None:
    """A user need not know what a usual estimator is made of."""
    text = 'name = "p"\ndescription = "a pump"\n[system]\nmodel = "pump:Pump"\n'
    read = parse_open_recipe(f"{text}[window]\nstep = 0.01\n[estimator]\n", "mine.toml")
    recipe = read.guess
    assert recipe.estimator is not None
    assert recipe.estimator.network.hidden == (64, 64)
    assert recipe.estimator.expert.pretraining is not None
    assert recipe.estimator.training.steps == 2000
    assert {"window.n_in", "data.estimator"} <= set(read.open_keys)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('description = "a\\u0001b"', "description"),
        ('[system]\nmodel = "m\\u0000"', "system.model"),
        ('[[data.excitation]]\nkind = "k\\uFFFE"', "data.excitation.kind"),
        ('"\\u0001" = 3', "the file"),
    ],
)
def test_text_that_no_xml_can_hold_is_refused_before_anything_is_made(
    text: str, place: str
) -> None:
    with pytest.raises(RecipeError, match=f"it: {place} holds .* expected text without control"):
        parse_open_recipe(text, "it")
