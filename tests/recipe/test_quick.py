"""A quick run takes its numbers from one table, and nothing else of a recipe changes."""

from __future__ import annotations

import tomllib
from functools import reduce
from pathlib import Path
from typing import Any

import pytest

from slide_fmu.pipeline.run_folder import RunFolder, recipe_of_provenance
from slide_fmu.recipe.quick import QUICK, SIZES, with_at_most
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError
from tests.refusals import refused

OPEN = """
name = "drive"
description = "a drive"
[system]
kind = "class"
model = "mbs_models.oscillators:DuffingOscillator"
[window]
step = 0.015625
n_in = 6
n_out = 2
[data]
duration = 8.0
burn_in = 0.1
[bound]
estimate_span = 0.2
"""
ESTIMATOR = "data.estimator", "data.estimator_validation"


def value_of(tables: Any, key: str) -> Any:
    return reduce(lambda inner, name: inner[name], key.split("."), tables)


def test_all_keys_are_open_no_more_and_have_the_quick_values() -> None:
    read = parse_open_recipe(OPEN, "drive.toml", QUICK)
    assert read.open_keys == ()
    tables = read.resolved().model_dump()
    for key, value in QUICK.items():
        if key not in ESTIMATOR:
            assert value_of(tables, key) == value, key
    assert set(SIZES) <= set(QUICK)


def test_what_is_no_key_of_a_quick_run_stays() -> None:
    quick = parse_open_recipe(OPEN, "drive.toml", QUICK).guess.model_dump()
    whole = parse_open_recipe(OPEN, "drive.toml").guess.model_dump()
    for key in QUICK:
        *places, name = key.split(".")
        value_of(whole, ".".join(places))[name] = value_of(quick, key)
    assert whole == quick


def test_smaller_numbers_and_chosen_sizes_stay() -> None:
    tables = tomllib.loads(OPEN) | {"network": {"hidden": 200}, "training": {"starts": 1}}
    tables["data"] |= {"train": 5, "validation": 500}
    found = with_at_most(tables, QUICK)
    assert (found["data"]["train"], found["data"]["validation"]) == (5, QUICK["data.validation"])
    assert found["network"]["hidden"] == 200
    assert found["training"]["starts"] == 1
    assert tables["data"]["validation"] == 500


def test_parts_that_a_recipe_lacks_are_not_added() -> None:
    tables = {key: table for key, table in tomllib.loads(OPEN).items() if key != "bound"}
    found = with_at_most(tables, QUICK)
    assert "bound" not in found
    assert "calibration" not in found["data"]
    assert "estimator" not in found["data"]
    found = with_at_most({**tables, "estimator": {}, "network": "state_space"}, QUICK)
    assert found["data"]["estimator"] == QUICK["data.estimator"]
    assert found["network"] == {"family": "state_space", "hidden": QUICK["network.hidden"]}


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"network": "feed_forward"}, "the network 'feed_forward'"),
        ({"system": {"kind": "record", "model": "a.csv"}}, "measured records"),
    ],
)
def test_recipes_without_a_quick_run_are_refused(changes: dict[str, Any], found: str) -> None:
    with refused(ValueError, found, "leave --quick out"):
        with_at_most(tomllib.loads(OPEN) | changes, QUICK)


def test_mistake_of_a_quick_run_names_the_recipe() -> None:
    text = OPEN + '\n[network]\nfamily = "feed_forward"\nhidden = [4]\n'
    with pytest.raises(RecipeError, match=r"^drive\.toml: --quick with the network"):
        parse_open_recipe(text, "drive.toml", QUICK)


def test_fmu_of_a_quick_run_carries_the_recipe_that_it_was_made_from() -> None:
    made_from = parse_open_recipe(OPEN, "drive.toml", QUICK).resolved()
    provenance = {"recipe": OPEN, "quick": dict(QUICK)}
    assert recipe_of_provenance(provenance, "drive.fmu") == made_from


def test_quick_and_whole_run_share_what_is_found_by_its_content_alone() -> None:
    whole, quick = (RunFolder.of(Path("runs"), "drive", quick) for quick in (False, True))
    assert whole == RunFolder(Path("runs/drive"))
    assert (whole.trajectories, whole.cache) == (quick.trajectories, quick.cache)
    own = ("checkpoints", "surrogate", "training", "sizing")
    assert not {getattr(whole, name) for name in own} & {getattr(quick, name) for name in own}
