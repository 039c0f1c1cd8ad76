"""Values of physical parameters for trajectories: where they lie, and that they are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw, split_stream
from slide_fmu.data.generation import generate
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from tests.progress import silent
from tests.recipes import tiny_recipe, tiny_state_space_recipe

TABLES: dict[str, Any] = {
    "mass": {"range": [1.0, 4.0], "unit": "kg", "transform": "log"},
    "stiffness": {"range": [1000.0, 1600.0], "unit": "N/m"},
}
BEYOND = {name: {**table, "beyond": 0.05} for name, table in TABLES.items()}


def recipe(**changes: Any) -> Recipe:
    return tiny_state_space_recipe(**{"parameters": TABLES, **changes})


def values(split: str, count: int, table: Recipe | None = None) -> np.ndarray:  # type: ignore[type-arg]
    wanted = table or recipe()
    points = [
        drawn_parameters(wanted, split_stream(wanted, split, index), index)
        for index in range(count)
    ]
    return np.array([list(point.values()) for point in points])


def test_values_to_learn_from_go_beyond_the_ranges_as_far_as_is_asked_for() -> None:
    drawn = values("train", 128, recipe(parameters=BEYOND))
    lows, highs = drawn.min(axis=0), drawn.max(axis=0)
    assert np.all(lows < [1.0, 1000.0])
    assert np.all(lows > [0.9, 960.0])
    assert np.all(highs > [4.0, 1600.0])
    assert np.all(highs < [4.4, 1640.0])


@pytest.mark.parametrize("split", ["train", "beyond", "validation", "estimator"])
@pytest.mark.parametrize("tables", [TABLES, BEYOND])
def test_all_other_values_stay_within_the_ranges(split: str, tables: dict[str, Any]) -> None:
    if tables is BEYOND and split in ("train", "beyond"):
        return
    drawn = values(split, 64, recipe(parameters=tables))
    assert np.all((drawn >= [1.0, 1000.0]) & (drawn <= [4.0, 1600.0]))


def test_values_are_even_in_the_transform() -> None:
    drawn = values("validation", 64)
    shares = np.log(drawn[:, 0]) / np.log(4.0)
    assert np.histogram(shares, 8, (0, 1))[0].tolist() == [8] * 8


def test_value_depends_on_stream_and_index_alone() -> None:
    few, many = values("train", 5), values("train", 9)
    assert np.array_equal(few, many[:5])
    stream = Stream(TEST, 7, (1.0, 1.0), 2.0)
    test = [drawn_parameters(recipe(), stream, index)["mass"] for index in range(5)]
    assert not set(test) & set(few[:, 0].tolist())
    other = drawn_parameters(recipe(), Stream(TEST, 8, (1.0, 1.0), 2.0), 0)
    assert other["mass"] != test[0]


def test_recipe_without_parameters_draws_none() -> None:
    plain = tiny_recipe()
    assert drawn_parameters(plain, split_stream(plain, "train", 0), 0) == {}


def test_files_keep_the_values_with_the_motions_of_systems_that_have_them(
    tmp_path: Path,
) -> None:
    table, folder = recipe(), tmp_path / "trajectories"
    assert generate(case_of(table), folder, None, silent) == 6
    split = Trajectories.of(case_of(table), folder).read("train")
    assert split.parameters is not None
    assert split.parameters.shape == (4, 2)
    for index, row in enumerate(split.parameters.tolist()):
        given = dict(zip(TABLES, row, strict=True))
        stream = split_stream(table, "train", index)
        assert given == pytest.approx(drawn_parameters(table, stream, index))
        system = case_of(table.at(given)).system
        expected = simulate_draw(system, draw(table, system, stream, index))
        assert np.array_equal(split.outputs[index], expected.outputs)
    assert generate(case_of(table), folder, None, silent) == 0


def test_trajectories_of_a_recipe_without_parameters_have_none(tmp_path: Path) -> None:
    table, folder = tiny_recipe(), tmp_path / "trajectories"
    generate(case_of(table), folder, None, silent)
    assert Trajectories.of(case_of(table), folder).read("train").parameters is None


def test_other_ranges_have_other_trajectories(tmp_path: Path) -> None:
    table, folder = recipe(), tmp_path / "trajectories"
    generate(case_of(table), folder, None, silent)
    wider = recipe(parameters={"mass": {**TABLES["mass"], "range": [1.0, 5.0]}})
    fixed = recipe().at({"mass": 2.0, "stiffness": 1300.0})
    for other in (wider, fixed):
        assert len(Trajectories.of(case_of(other), folder).missing()) == 6
    assert Trajectories.of(case_of(table), folder).missing() == []
