"""Trajectories are files by what decides them: what is the same is found, what changed is made."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core import result_cache
from slide_fmu.core.files import FullDiskError
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.core.signals import Trajectory
from slide_fmu.data.generation import generate
from slide_fmu.data.model_answers import kept_answers, model_key
from slide_fmu.data.trajectories import Trajectories, TrajectoryError
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import SPLITS, Recipe
from tests.progress import silent
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe
from tests.refusals import refused

COUNTS = {"train": 4, "validation": 1, "estimator": 1, "estimator_validation": 1}
KIND = {"kind": "binary", "weight": 1.0, "duration": [0.1, 0.3]}
MODEL = "model"
"""Key of the model, where none is simulated."""


def recipe(**changes: Any) -> Recipe:
    return tiny_recipe(**{"data": COUNTS, "estimator": ESTIMATOR, **changes})


RECIPE = recipe()
SAMPLES = round(RECIPE.data.duration / RECIPE.window.step)


def trajectory(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    inputs, outputs = rng.normal(size=(SAMPLES, 1)), rng.normal(size=(SAMPLES + 1, 1))
    return Trajectory(RECIPE.window.step, inputs, outputs)


def of(wanted: Recipe, folder: Path) -> Trajectories:
    return Trajectories(folder, case_of(wanted), MODEL)


@pytest.fixture
def made(tmp_path: Path) -> Trajectories:
    """The training trajectories of the recipe."""
    trajectories = of(RECIPE, tmp_path / "trajectories")
    for index in (2, 0, 3, 1):
        trajectories.write("train", index, trajectory(index), kind=index % 2)
    return trajectories


def test_written_trajectories_are_read(made: Trajectories) -> None:
    split = made.read("train")
    assert split.kinds.tolist() == [0, 1, 0, 1]
    assert split.parameters is None
    for index in range(4):
        assert np.array_equal(split.inputs[index], trajectory(index).inputs)
        assert np.array_equal(split.outputs[index], trajectory(index).outputs)
    assert np.array_equal(made.read("train", 2).outputs, split.outputs[:2])
    assert made.read("estimator", 0).inputs.shape == (0, SAMPLES, 1)


def test_missing_trajectories_are_reported(made: Trajectories) -> None:
    others = [(split, 0) for split in ("validation", "estimator", "estimator_validation")]
    assert made.missing() == others
    made.remove("train", 2)
    assert made.missing() == [("train", 2), *others]
    with refused(TrajectoryError, "1 of 4 trajectories of split 'train'", "generate them first"):
        made.read("train")
    with refused(TrajectoryError, "1 of 4 trajectories of split 'train'", "generate them first"):
        made.require()


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.99])
def test_damaged_trajectory_is_named_and_made_again_alone(tmp_path: Path, part: float) -> None:
    case, folder = case_of(RECIPE), tmp_path / "trajectories"
    generate(case, folder, None, silent)
    whole = Trajectories.of(case, folder)
    file = whole.file("train", 2).path
    content, before = file.read_bytes(), whole.read("train")
    damaged = bytearray(content)
    damaged[int(part * len(content))] ^= 1
    for broken in (bytes(damaged), content[: int(part * len(content))]):
        file.write_bytes(broken)
        with refused(DamagedFileError, f"{file.name} is damaged", "generate again"):
            whole.read("train")
        assert whole.missing() == [("train", 2)]
        assert generate(case, folder, None, silent) == 1
        assert np.array_equal(whole.read("train").outputs, before.outputs)


@pytest.mark.parametrize(
    "changes",
    [
        {"data": {**COUNTS, "train": 9, "validation": 3}},
        {"data": {**COUNTS, "most_failures": 0.5, "beyond_factor": (2.0, 3.0)}},
        {"training": {"steps": 1}, "network": {"hidden": [9]}, "window": {"n_in": 50}},
        {"system": {"reference": {"substeps": 24}}},
        {"data": {"train": 4, "validation": 1}, "estimator": None},
        {"estimator": {**ESTIMATOR, "expert": {"in_range": 0.25}}},
    ],
    ids=["numbers", "failures", "training", "reference", "no estimator", "other estimator"],
)
def test_trajectories_that_a_change_leaves_as_they_are_stay(
    made: Trajectories, changes: dict[str, Any]
) -> None:
    other = of(recipe(**changes), made.folder)
    assert np.array_equal(other.read("train", 4).outputs, made.read("train").outputs)


@pytest.mark.parametrize(
    "changes",
    [
        {"data": {**COUNTS, "seed": 8}},
        {"data": {**COUNTS, "burn_in": 0.5}},
        {"data": {**COUNTS, "excitation": [{"kind": "held_random", "weight": 2.0}]}},
        {"window": {"step": 0.03125}},
        {"system": {"parameters": {"damping": 8}}},
    ],
    ids=["seed", "burn-in", "excitation", "step", "parameter"],
)
def test_recipe_of_other_values_has_other_trajectories_and_the_former_ones_stay(
    made: Trajectories, changes: dict[str, Any]
) -> None:
    other = of(recipe(**changes), made.folder)
    assert ("train", 0) in other.missing()
    other.write("train", 0, trajectory(7), kind=0)
    assert other.is_whole("train", 0)
    assert np.array_equal(made.read("train", 1).outputs[0], trajectory(0).outputs)


def keys(wanted: Recipe, split: str, folder: Path) -> list[str]:
    return [of(wanted, folder).key(split, index) for index in range(2)]


def test_kinds_of_excitation_decide_the_splits_that_are_drawn_from_them(tmp_path: Path) -> None:
    own = {"bound": 6, "companion": 4, "duration": 4.0}
    plain = tiny_state_space_recipe(data=own, bound={})
    wide = {**KIND, "duration": [0.1, 0.9]}
    of_bound, others = (
        tiny_state_space_recipe(data=own, bound={"excitation": [kind]}) for kind in (KIND, wide)
    )
    of_training = tiny_state_space_recipe(
        data=own, bound={}, training={"expert": {"excitation": [KIND]}}
    )
    for split in ("train", "validation", "bound"):
        assert keys(plain, split, tmp_path) == keys(of_bound, split, tmp_path)
    assert keys(of_bound, "further", tmp_path) != keys(others, "further", tmp_path)
    assert keys(plain, "train", tmp_path) != keys(of_training, "train", tmp_path)
    assert keys(plain, "validation", tmp_path) == keys(of_training, "validation", tmp_path)


@pytest.mark.parametrize("declared", [{"start": 0.5}, {"high": 2.0}, {"hold": "first_order"}])
def test_what_a_model_declares_of_its_inputs_decides_its_motions(
    made: Trajectories, declared: dict[str, Any]
) -> None:
    """Its answers need not show this: their short motion is of one kind of excitation."""
    other = case_of(RECIPE)
    other.source.inputs = tuple(replace(one, **declared) for one in other.source.inputs)
    assert Trajectories(made.folder, other, MODEL).key("train", 0) != made.key("train", 0)


def test_range_of_amplitudes_decides_the_trajectories_beyond(tmp_path: Path) -> None:
    one, other = (recipe(data={**COUNTS, "beyond_factor": (2.0, high)}) for high in (3.0, 4.0))
    assert keys(one, "beyond", tmp_path) != keys(other, "beyond", tmp_path)
    beyond = [recipe(estimator={**ESTIMATOR, "beyond": wider}) for wider in (False, True)]
    within, outside = (keys(wanted, "estimator", tmp_path) for wanted in beyond)
    assert within[0] == outside[0]  # every second one is in range
    assert within[1] != outside[1]


def test_every_trajectory_has_a_key_of_its_own(tmp_path: Path) -> None:
    trajectories = of(RECIPE, tmp_path)
    splits = [split for split in SPLITS if split != "further"]
    made = [trajectories.key(split, index) for split in splits for index in range(9)]
    assert len(set(made)) == len(made)


@pytest.mark.parametrize("size", [1.0, 1e-9])
def test_changed_model_has_another_key_and_rounding_has_not(tmp_path: Path, size: float) -> None:
    answers = size * np.array([[0.0], [0.1], [0.3]])
    key = model_key(tmp_path, answers)
    assert model_key(tmp_path, answers * (1 + 1e-9)) == key
    assert np.array_equal(kept_answers(tmp_path, key), answers)
    other = model_key(tmp_path, answers * 1.001)
    assert other != key
    assert model_key(tmp_path, answers) == key
    (tmp_path / f"{key}.npz").unlink()
    with refused(DamagedFileError, f"{key}.npz is damaged"):
        kept_answers(tmp_path, key)


def test_trajectory_that_has_no_room_is_missing_and_made_again(
    made: Trajectories, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: bytes) -> None:
        raise FullDiskError(errno.ENOSPC, "No space left on device", str(path))

    made.remove("train", 1)
    with monkeypatch.context() as patch:
        patch.setattr(result_cache, "write_whole", full)
        with refused(FullDiskError, "cannot be written", "make room there"):
            made.write("train", 1, trajectory(1), kind=0)
    assert ("train", 1) in made.missing()
    made.write("train", 1, trajectory(1), kind=0)
    assert len(made.read("train").inputs) == 4


LAG = """
inputs = {"u": {"unit": "1", "range": [-1, 1]}}
outputs = {"y": {"unit": "1", "range": [-1, 1]}}
start = [0.0]

def f(x, u, p):
    return [5.0 * (u[0] - x[0])]

def g(x, u, p):
    return [x[0]]
"""
RECIPE_OF_LAG = """
name = "lag"
description = "a lag"

[system]
kind = "function"
model = "MODEL"

[window]
step = 0.05
n_in = 96
n_out = 32
"""


def test_states_of_functions_are_kept_where_a_fit_may_begin_at_them(tmp_path: Path) -> None:
    model = tmp_path / "lag.py"
    model.write_text(LAG, encoding="utf-8")
    wanted = parse_open_recipe(RECIPE_OF_LAG.replace("MODEL", str(model)), "recipe").guess
    counts = wanted.data.model_copy(update={"train": 2, "validation": 1})
    case = case_of(wanted.model_copy(update={"data": counts}))
    generate(case, tmp_path / "trajectories", None, silent)
    split = Trajectories.of(case, tmp_path / "trajectories").read("train")
    assert split.states is not None
    np.testing.assert_array_equal(split.states[..., 0], split.outputs[..., 0])
    one = split.chosen([1])
    assert one.states is not None
    np.testing.assert_array_equal(one.states, split.states[1:])
    assert one.parameters is None


def test_other_systems_show_no_states(made: Trajectories) -> None:
    assert made.read("train").states is None
