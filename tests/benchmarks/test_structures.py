"""The table of structures: variants of a recipe, trained once, measured and timed together."""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path
from typing import Any

import pytest
import structures
import studies
from recipes import TINY
from structures import read_variants, study

from slide_fmu import pipeline
from slide_fmu.recipe import parse_recipe

HERE = Path(__file__).parent
TRAINING = HERE.parents[1] / "training"
VARIANTS = """
[as_it_is]

[less]
data = { train = 2 }

[state_space]
without = ["network", "training"]
network = { order = 2, hidden = 0 }
training = { starts = 1, start_iterations = 2, kept_iterations = 2, iterations = 2 }
"""


def no_bar(stage: str) -> pipeline.Advance:
    return lambda done, total, remark: None


@pytest.fixture
def arguments(tmp_path: Path) -> argparse.Namespace:
    recipe, variants = tmp_path / "tiny.toml", tmp_path / "variants.toml"
    recipe.write_text(TINY, encoding="utf-8")
    variants.write_text(VARIANTS, encoding="utf-8")
    return argparse.Namespace(
        recipe=recipe, variants=variants, runs=tmp_path / "runs", train=None, trajectories=2,
        seed=1, rounds=1,
    )  # fmt: skip


def test_variants_are_trained_once_and_measured_together(
    arguments: argparse.Namespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = study(arguments, no_bar)
    first, less, state_space = table["variants"]
    assert [row["variant"] for row in table["variants"]] == ["as_it_is", "less", "state_space"]
    assert [row["family"] for row in table["variants"]] == [*["feed_forward"] * 2, "state_space"]
    assert (first["simulated_seconds"], less["simulated_seconds"]) == (8.0, 4.0)
    assert first["relative_rmse"] != less["relative_rmse"]
    assert state_space["parameters"] < first["parameters"]
    for row in table["variants"]:
        assert row["training_cpu_seconds"] > 0
        assert 0 < row["kernel_us"] < row["step_us"]
    monkeypatch.setattr(structures, "trained", None)  # nothing is left to train
    again = study(arguments, no_bar)
    for row, other in zip(table["variants"], again["variants"], strict=True):
        same = {"relative_rmse", "training_cpu_seconds", "parameters"}
        assert {key: row[key] for key in same} == {key: other[key] for key in same}


def test_first_trajectories_are_those_that_the_recipe_makes(
    arguments: argparse.Namespace, tmp_path: Path
) -> None:
    from slide_fmu.data.store import StoreError, read_split

    job = pipeline.open_job(arguments.recipe, arguments.runs, no_bar)
    pipeline.generate_data(job, 1, False)
    fewer = studies.with_train(job.recipe, 2)
    copied = studies.first_trajectories(fewer, job.folder.store, tmp_path / "copies")
    own = pipeline.Job(job.text, fewer, pipeline.RunFolder(tmp_path / "own"), no_bar)
    pipeline.generate_data(own, 1, False)
    for split in ("train", "validation"):
        there, here = read_split(copied, split), read_split(own.folder.store, split)
        assert there.inputs.tobytes() == here.inputs.tobytes()
        assert there.outputs.tobytes() == here.outputs.tobytes()
        assert there.kinds.tolist() == here.kinds.tolist()
    more = studies.with_train(job.recipe, 5)
    with pytest.raises(StoreError, match="4 trajectories of split 'train'; expected at least 5"):
        studies.first_trajectories(more, job.folder.store, tmp_path / "copies")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[a]\nwindow = { n_in = 3 }", "variant 'a' = .*expected a table with some of"),
        ("[a]\ndata = { seed = 3 }", "variant 'a': data = .* expected train alone"),
        ('[a]\nwithout = ["network.units"]', "without 'network.units': no 'units' in"),
        ('[a]\nnetwork = { family = "state_space" }', "variant 'a': .*training.method"),
        ("a = 3", "variant 'a' = 3; expected a table"),
        ("[a", "cannot be read"),
    ],
)
def test_mistakes_in_variants_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "variants.toml"
    path.write_text(text, encoding="utf-8")
    changes = {"training": {"method": "adam"}}
    tables: dict[str, Any] = structures.merged(tomllib.loads(TINY), changes)
    with pytest.raises(SystemExit, match=f"(?s){message}"):
        read_variants(path, tables, None)


@pytest.mark.parametrize("name", ["robot_6r", "slider_crank"])
def test_released_recipes_and_their_variants_fit(name: str) -> None:
    text = (TRAINING / f"{name}.toml").read_text("utf-8")
    variants = read_variants(HERE / "variants" / f"{name}.toml", tomllib.loads(text), None)
    assert variants[0].recipe == studies.surrogate_only(parse_recipe(text, name))
    assert len({variant.key() for variant in variants}) == len(variants) > 5
    fewer = read_variants(HERE / "variants" / f"{name}.toml", tomllib.loads(text), 7)
    assert {variant.recipe.data.train for variant in fewer} == {7}
