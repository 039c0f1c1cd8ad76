"""The table of structures: variants of a recipe, trained once, measured and timed together."""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path
from typing import Any

import pytest
import structures
import studies
from structures import read_variants, study

from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.reading import parse_recipe
from tests.progress import no_stages
from tests.recipes import TINY

pytestmark = pytest.mark.extended

HERE = Path(__file__).parent
TRAINING = HERE.parents[1] / "training"
VARIANTS = """
[as_it_is]

[less]
data = { train = 2 }

[state_space]
without = ["network", "training"]
network = { order = 2, hidden = 0 }
training = { starts = 1, iterations = 2, expert = { start_iterations = 2, kept_iterations = 2 } }
"""


@pytest.fixture(params=[1, 2], ids=["one after the other", "at once"])
def arguments(tmp_path: Path, request: pytest.FixtureRequest) -> argparse.Namespace:
    workers = request.param
    recipe, variants = tmp_path / "tiny.toml", tmp_path / "variants.toml"
    recipe.write_text(TINY, encoding="utf-8")
    variants.write_text(VARIANTS, encoding="utf-8")
    return argparse.Namespace(
        recipe=recipe, variants=variants, runs=tmp_path / "runs", trajectories=2,
        seed=1, rounds=1, workers=workers,
    )  # fmt: skip


def test_variants_are_trained_once_and_measured_together(
    arguments: argparse.Namespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = study(arguments, no_stages)
    first, less, state_space = table["variants"]
    assert [row["variant"] for row in table["variants"]] == ["as_it_is", "less", "state_space"]
    assert [row["family"] for row in table["variants"]] == [*["feed_forward"] * 2, "state_space"]
    assert (first["simulated_seconds"], less["simulated_seconds"]) == (8.0, 4.0)
    assert first["relative_rmse"] != less["relative_rmse"]
    assert state_space["parameters"] < first["parameters"]
    for row in table["variants"]:
        assert row["training_cpu_seconds"] > 0
        assert 0 < row["kernel_us"] < row["step_us"]
    monkeypatch.setattr(studies, "_train", None)  # nothing is left to train
    again = study(arguments, no_stages)
    for row, other in zip(table["variants"], again["variants"], strict=True):
        same = {"relative_rmse", "training_cpu_seconds", "parameters"}
        assert {key: row[key] for key in same} == {key: other[key] for key in same}


def test_trainings_of_another_model_are_not_kept(
    arguments: argparse.Namespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = study(arguments, no_stages)["variants"]
    calls = []
    train = studies._train
    monkeypatch.setattr(studies, "_train", lambda *given: (calls.append(given), train(*given)))
    monkeypatch.setattr(studies, "_motion", lambda store: "another")
    arguments.workers = 1
    again = study(arguments, no_stages)["variants"]
    assert len(calls) == len(first) == len(again)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[a]\nwindow = { n_in = 3 }", "variant 'a' = .*expected a table with some of"),
        ("[a]\ndata = { seed = 3 }", "variant 'a': data = .* expected train alone"),
        ('[a]\nwithout = ["network.units"]', "without 'network.units': no 'units' in"),
        ('[a]\nnetwork = { family = "state_space" }', "variant 'a': .*training.method"),
        ("a = 3", "variant 'a' = 3; expected a table"),
        ("[a]\ndata = 3", "variant 'a': data = 3; expected train alone"),
        ('[a]\nwithout = "network.bias"', "without = 'network.bias'; expected a list"),
        ("", "has none; expected a table for each"),
        ("[a", "cannot be read"),
    ],
)
def test_mistakes_in_variants_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "variants.toml"
    path.write_text(text, encoding="utf-8")
    changes = {"training": {"method": "adam"}}
    tables: dict[str, Any] = structures.merged(tomllib.loads(TINY), changes)
    with pytest.raises(SystemExit, match=f"(?s){message}"):
        read_variants(path, tables)


@pytest.mark.parametrize("name", ["robot_6r", "slider_crank"])
def test_recipes_and_their_variants_fit(name: str) -> None:
    text = (TRAINING / f"{name}.toml").read_text("utf-8")
    variants = read_variants(HERE / "variants" / f"{name}.toml", tomllib.loads(text))
    recipe = studies.surrogate_only(parse_recipe(text, name))
    released = recipe
    if recipe.training.start is not None:  # its network is that of the start
        _, provenance = read_fmu(TRAINING.parent / recipe.training.start)
        released = recipe_of_provenance(provenance, recipe.training.start)
    assert variants["as_released"].network == released.network
    assert len({studies.training_key(one) for one in variants.values()}) == len(variants) > 5
    baseline = (TRAINING / f"{name}_feed_forward.toml").read_text("utf-8")
    fair = studies.surrogate_only(parse_recipe(baseline, name))
    one = variants["feed_forward"]
    assert (one.network, one.training) == (fair.network, fair.training)
    assert one.data.train == recipe.data.train


def test_every_variant_may_be_changed(tmp_path: Path) -> None:
    path = tmp_path / "variants.toml"
    text = "[every]\ntraining = { steps = 3 }\n[a]\n[b]\ntraining = { steps = 4, batch = 5 }"
    path.write_text(text, encoding="utf-8")
    found = read_variants(path, tomllib.loads(TINY))
    steps = {name: recipe.training.model_dump()["steps"] for name, recipe in found.items()}
    assert steps == {"a": 3, "b": 4}
