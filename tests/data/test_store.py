"""The store: what is done stays, what is not done is reported, and other recipes are refused."""

from __future__ import annotations

import errno
import json
import os
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from slide_fmu.core.files import FullDiskError
from slide_fmu.core.signals import Trajectory
from slide_fmu.data.errors import StoreError
from slide_fmu.data.fingerprint import data_fingerprint
from slide_fmu.data.generation import shapes_of
from slide_fmu.data.origin import require_origin
from slide_fmu.data.store import open_store
from slide_fmu.data.store_preparation import prepared_store, remove_store
from slide_fmu.data.stored_split import StoredSplit
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import SPLITS, Recipe
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe
from tests.refusals import refused

SHAPES = {"inputs": (5, 2), "outputs": (6, 1)}
MOTION = np.array([[0.0], [0.1], [0.3]])

COUNTS = {"train": 4, "validation": 1, "estimator": 1, "estimator_validation": 1}


def recipe(**changes: Any) -> Recipe:
    return tiny_recipe(**{"data": COUNTS, "estimator": ESTIMATOR, **changes})


def surrogate_only(train: int) -> Recipe:
    return tiny_recipe(data={"train": train, "validation": 1})


RECIPE = recipe()


def trajectory(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    return Trajectory(RECIPE.window.step, rng.normal(size=(5, 2)), rng.normal(size=(6, 1)))


def content(path: Path) -> dict[str, bytes]:
    return {str(p.relative_to(path)): p.read_bytes() for p in path.rglob("*") if p.is_file()}


def train(path: Path) -> StoredSplit:
    return open_store(path).split("train")


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "data.zarr"
    prepared_store(path, RECIPE, SHAPES, MOTION)
    return path


def test_written_trajectories_are_read(store: Path) -> None:
    for index in (2, 0, 3, 1):
        train(store).write(index, trajectory(index), kind=index % 2)
    split = train(store).read(4)
    assert split.kinds.tolist() == [0, 1, 0, 1]
    for index in range(4):
        assert np.array_equal(split.inputs[index], trajectory(index).inputs)
        assert np.array_equal(split.outputs[index], trajectory(index).outputs)
    assert open_store(store).split("estimator").read(0).inputs.shape == (0, 5, 2)


def test_missing_trajectories_are_reported(store: Path) -> None:
    assert train(store).missing(4) == [0, 1, 2, 3]
    train(store).write(2, trajectory(2), kind=0)
    assert train(store).missing(4) == [0, 1, 3]
    assert open_store(store).split("validation").missing(1) == [0]
    with refused(StoreError, "3 of 4", "split 'train'"):
        train(store).read(4)


def test_half_written_trajectory_is_missing_and_made_again(store: Path) -> None:
    """A process that died after the data, before the flag."""
    zarr.open_group(store, mode="r+")["train/inputs"][1] = np.ones((5, 2))
    zarr.open_group(store, mode="r+")["train/outputs"][1] = np.ones((6, 1))
    assert 1 in train(store).missing(4)
    for index in range(4):
        train(store).write(index, trajectory(index), kind=0)
    assert np.array_equal(train(store).read(4).outputs[1], trajectory(1).outputs)


def test_flag_is_written_last(store: Path) -> None:
    whole = trajectory(0)
    outputs_that_do_not_fit = Trajectory(whole.step, whole.inputs[:4], whole.outputs[:5])
    with pytest.raises(ValueError):  # noqa: PT011 (zarr's own words)
        train(store).write(0, outputs_that_do_not_fit, kind=0)
    assert 0 in train(store).missing(4)


def test_opening_again_keeps_what_is_done(store: Path) -> None:
    train(store).write(2, trajectory(2), kind=0)
    before = content(store)
    changed_only_in_training = recipe(
        training={"steps": 1},
        network={"hidden": [9]},
        window={"n_in": 50},
    )
    prepared_store(store, changed_only_in_training, SHAPES, MOTION)
    assert content(store) == before


def test_a_reference_of_its_own_belongs_to_no_data(store: Path) -> None:
    """Stores made before recipes had such a table stay valid too."""
    finer = recipe(system={"reference": {"substeps": 24}})
    prepared_store(store, finer, SHAPES, MOTION)
    assert "reference" not in data_fingerprint(finer).system


@pytest.mark.parametrize(
    ("key", "changes"),
    [
        ("data.seed = 7 there, 8 here", {"data": {"seed": 8}}),
        ("data.burn_in = 0.25 there, 0.5", {"data": {"burn_in": 0.5}}),
        ("data.excitation", {"data": {"excitation": [{"kind": "held_random", "weight": 2.0}]}}),
        ("step = 0.015625 there, 0.03125", {"window": {"step": 0.03125}}),
        ("system.parameters.damping = 40.0 there, 8", {"system": {"parameters": {"damping": 8}}}),
    ],
)
def test_other_recipe_is_refused_and_the_store_untouched(
    store: Path, key: str, changes: dict[str, Any]
) -> None:
    train(store).write(2, trajectory(2), kind=0)
    before = content(store)
    data = {**COUNTS, **changes.get("data", {})}
    other = recipe(**{**changes, "data": data})
    with pytest.raises(StoreError, match=f"generated from other values: {key}") as caught:
        prepared_store(store, other, SHAPES, MOTION)
    assert str(store) in str(caught.value)
    assert content(store) == before


def test_half_made_store_is_made_again(tmp_path: Path) -> None:
    """A process that died while it created the store."""
    path = tmp_path / "data.zarr"
    name = f"data.zarr.{os.getpid()}.{threading.get_ident()}"  # once had the same numbers
    (tmp_path / name).mkdir()
    (tmp_path / name / "zarr.json").write_text("{")
    prepared_store(path, RECIPE, SHAPES, MOTION)
    assert train(path).missing(4) == [0, 1, 2, 3]
    assert [p.name for p in tmp_path.iterdir()] == ["data.zarr"]


@pytest.mark.parametrize("make", [Path.mkdir, Path.touch], ids=["folder", "file"])
def test_place_that_holds_something_else_is_refused(tmp_path: Path, make: Any) -> None:
    path = tmp_path / "data.zarr"
    make(path)
    with refused(StoreError, "trajectory store", "remove it"):
        prepared_store(path, RECIPE, SHAPES, MOTION)


def test_missing_store_is_reported(tmp_path: Path) -> None:
    with refused(StoreError, "no data at", "generate"):
        open_store(tmp_path / "data.zarr").split("train").read(4)


def test_store_of_a_changed_model_is_refused(store: Path) -> None:
    with refused(StoreError, "the model has changed", "generate again"):
        prepared_store(store, RECIPE, SHAPES, MOTION * 1.001)
    prepared_store(store, RECIPE, SHAPES, MOTION)


def test_damaged_file_is_named(store: Path) -> None:
    for index in range(4):
        train(store).write(index, trajectory(index), kind=0)
    chunk = max((store / "train" / "outputs").rglob("c/*/*/*"), key=lambda path: path.name)
    chunk.write_bytes(chunk.read_bytes()[:10])
    with refused(StoreError, "split 'train' is damaged", "--overwrite"):
        train(store).read(4)


def test_chunk_with_a_flipped_bit_is_refused_and_its_file_is_named(store: Path) -> None:
    for index in range(4):
        train(store).write(index, trajectory(index), kind=1)
    for chunk in (store / "train").rglob("c/2*"):
        files = [chunk] if chunk.is_file() else [f for f in chunk.rglob("*") if f.is_file()]
        name = files[0].relative_to(store / "train").as_posix()
        whole = files[0].read_bytes()
        for place in np.linspace(0, len(whole) - 1, 16).astype(int):
            broken = bytearray(whole)
            broken[place] ^= 1 << (place % 8)
            files[0].write_bytes(broken)
            with pytest.raises(StoreError, match=rf"'train' is damaged.*{name}.*--overwrite"):
                train(store).read(4)
        files[0].write_bytes(whole)
    train(store).read(4)


def test_missing_files_of_a_store_are_reported(store: Path) -> None:
    """Of a trajectory that is called done, of a split, of the whole."""
    for index in range(4):
        train(store).write(index, trajectory(index), kind=0)
    shutil.rmtree(store / "train" / "outputs" / "c" / "1")
    with refused(StoreError, "split 'train' is damaged", "trajectory 1 is not whole"):
        train(store).read(4)
    shutil.rmtree(store / "beyond")
    with refused(StoreError, "split 'beyond' is damaged", "--overwrite"):
        prepared_store(store, RECIPE, SHAPES, MOTION)
    (store / "zarr.json").write_text("{", encoding="utf-8")
    with refused(StoreError, "trajectory store", "remove it"):
        prepared_store(store, RECIPE, SHAPES, MOTION)


def test_store_of_another_format_is_refused_with_the_remedy(store: Path) -> None:
    group = zarr.open_group(store, mode="r+")
    group.attrs["format"] = 0
    with refused(StoreError, "another version", "--overwrite"):
        prepared_store(store, RECIPE, SHAPES, MOTION)


def test_removed_store_is_gone(store: Path) -> None:
    remove_store(store)
    assert not store.exists()
    remove_store(store)


@pytest.mark.extended
def test_several_may_create_the_store_at_once(tmp_path: Path) -> None:
    path = tmp_path / "data.zarr"
    with ThreadPoolExecutor(4) as pool:
        for round_ in range(5):
            folder = path.with_name(f"{round_}") / path.name
            folder.parent.mkdir()
            made = [pool.submit(prepared_store, folder, RECIPE, SHAPES, MOTION) for _ in range(4)]
            for future in made:
                future.result()
            assert train(folder).missing(4) == [0, 1, 2, 3]
            assert [p.name for p in folder.parent.iterdir()] == ["data.zarr"]


def test_recipes_with_and_without_estimator_share_a_store(tmp_path: Path) -> None:
    """The first to have one settles what its trajectories are drawn from."""
    path, alone = tmp_path / "data.zarr", surrogate_only(4)
    prepared_store(path, alone, SHAPES, MOTION)
    train(path).write(1, trajectory(1), kind=0)
    prepared_store(path, RECIPE, SHAPES, MOTION)
    assert train(path).missing(4) == [0, 2, 3]
    assert open_store(path).split("estimator").missing(1) == [0]
    prepared_store(path, alone, SHAPES, MOTION)
    require_origin(open_store(path), alone, MOTION)
    other = recipe(estimator={**ESTIMATOR, "expert": {"in_range": 0.25}})
    with refused(StoreError, "estimator.expert.in_range = 0.5 there, 0.25"):
        require_origin(open_store(path), other, MOTION)
    prepared_store(path, other, SHAPES, MOTION)
    require_origin(open_store(path), other, MOTION)


def test_store_gets_room_for_further_kinds_and_refuses_others(tmp_path: Path) -> None:
    path = tmp_path / "data.zarr"
    kind = {"kind": "binary", "weight": 1.0, "duration": [0.1, 0.3]}

    def with_kinds(*kinds: dict[str, Any]) -> Recipe:
        own = {"bound": 6, "companion": 4, "duration": 4.0}
        return tiny_state_space_recipe(data=own, bound={"excitation": list(kinds)})

    shapes = shapes_of(with_kinds(), case_of(with_kinds()).system)
    prepared_store(path, with_kinds(), shapes, MOTION)
    assert open_store(path).split("further").missing() == []
    prepared_store(path, with_kinds(kind), shapes, MOTION)
    assert open_store(path).split("further").missing() == [0, 1, 2]
    prepared_store(path, with_kinds(), shapes, MOTION)
    with refused(StoreError, "bound.excitation 1.duration = [", "0.3", "there, ["):
        prepared_store(path, with_kinds({**kind, "duration": [0.1, 0.9]}), shapes, MOTION)


def test_store_refuses_kinds_that_its_trajectories_were_not_drawn_from(tmp_path: Path) -> None:
    path, kind = tmp_path / "data.zarr", {"kind": "rest", "weight": 1.0, "duration": [0.1, 0.3]}
    plain = tiny_state_space_recipe()
    prepared_store(path, plain, shapes_of(plain, case_of(plain).system), MOTION)
    more = tiny_state_space_recipe(training={"expert": {"excitation": [kind]}})
    with refused(StoreError, "training = None there", "'rest'"):
        prepared_store(path, more, shapes_of(more, case_of(more).system), MOTION)


def test_a_store_grows_and_gives_the_first_ones(store: Path) -> None:
    for index in range(4):
        train(store).write(index, trajectory(index), kind=0)
    prepared_store(store, surrogate_only(6), SHAPES, MOTION)
    assert train(store).missing(6) == [4, 5]
    assert train(store).missing(3) == []
    with refused(StoreError, "2 of 6", "split 'train'"):
        train(store).read(6)
    with refused(StoreError, "9 of 9", "split 'beyond'"):
        open_store(store).split("beyond").read(9)
    before = content(store)
    prepared_store(store, surrogate_only(2), SHAPES, MOTION)
    assert content(store) == before
    first = train(store).read(3)
    assert [len(values) for values in (first.inputs, first.outputs, first.kinds)] == [3, 3, 3]
    assert np.array_equal(first.outputs[2], trajectory(2).outputs)


def test_small_outputs_show_a_changed_model_too(tmp_path: Path) -> None:
    path = tmp_path / "data.zarr"
    prepared_store(path, RECIPE, SHAPES, 1e-9 * MOTION)
    with refused(StoreError, "the model has changed"):
        prepared_store(path, RECIPE, SHAPES, 1.001e-9 * MOTION)


def full(*arguments: Any, **more: Any) -> None:
    """Stand for what writes."""
    raise OSError(errno.ENOSPC, "No space left on device")


def test_store_that_has_no_room_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "data.zarr"
    with monkeypatch.context() as patch:
        patch.setattr(zarr.Group, "create_array", full)
        with refused(FullDiskError, "data.zarr' cannot be written", "make room there"):
            prepared_store(path, RECIPE, SHAPES, MOTION)
    assert list(tmp_path.iterdir()) == []
    prepared_store(path, RECIPE, SHAPES, MOTION)


def test_trajectory_that_has_no_room_is_missing_and_made_again(
    store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train(store).write(0, trajectory(0), kind=0)
    with monkeypatch.context() as patch:
        patch.setattr(zarr.Array, "__setitem__", full)
        with refused(FullDiskError, "data.zarr' cannot be written"):
            train(store).write(1, trajectory(1), kind=0)
    assert train(store).missing(4) == [1, 2, 3]
    train(store).write(1, trajectory(1), kind=0)
    assert train(store).missing(4) == [2, 3]


def test_store_that_lacks_a_part_is_refused_before_anything_is_learnt(tmp_path: Path) -> None:
    path = tmp_path / "store"
    kind = {"kind": "binary", "weight": 1.0, "duration": [0.1, 0.3]}
    own = {"train": 1, "validation": 1, "companion": 1, "bound": 6, "calibration": 20}
    own["duration"] = 4.0
    plain, more = (
        tiny_state_space_recipe(data=own, bound={"excitation": kinds}) for kinds in ([], [kind])
    )
    prepared_store(path, plain, SHAPES, MOTION)
    for split in SPLITS:
        for index in range(plain.count(split)):
            open_store(path).split(split).write(index, trajectory(index), kind=0)
    open_store(path).require(plain)
    lacking = r"3 of 3 trajectories of split 'further' are missing; generate again to complete"
    with pytest.raises(StoreError, match=lacking):
        open_store(path).require(more)
    with refused(StoreError, "no data at"):
        open_store(tmp_path / "other").require(more)


@pytest.mark.parametrize(("name", "length"), [("inputs", 4), ("outputs", 4), ("inputs", 7)])
def test_length_that_a_flipped_bit_has_changed_is_named(
    store: Path, name: str, length: int
) -> None:
    for index in range(4):
        train(store).write(index, trajectory(index), kind=0)
    place = store / "train" / name / "zarr.json"
    description = json.loads(place.read_text())
    description["shape"][1] = length
    place.write_text(json.dumps(description))
    with pytest.raises(StoreError, match=rf"'train' is damaged .*{name}/zarr.json"):
        train(store).read(4)


@pytest.mark.parametrize(("old", "new"), [("separator", "separador"), ("chunk_shape", "chunk_3")])
def test_key_of_an_array_that_a_flipped_bit_has_changed_is_reported(
    store: Path, old: str, new: str
) -> None:
    place = store / "train" / "done" / "zarr.json"
    place.write_text(place.read_text().replace(old, new))
    with refused(StoreError, "'train' is damaged"):
        prepared_store(store, RECIPE, SHAPES, MOTION)


@pytest.mark.parametrize(
    ("old", "new"), [('"data":', '"datc":'), ('"attributes"', '"atTributes"'), ("0.1", '"0.1x"')]
)
def test_key_of_a_store_that_a_flipped_bit_has_changed_is_reported(
    store: Path, old: str, new: str
) -> None:
    place = store / "zarr.json"
    place.write_text(place.read_text().replace(old, new, 1))
    with refused(StoreError, "not a trajectory store", "remove it"):
        prepared_store(store, RECIPE, SHAPES, MOTION)
