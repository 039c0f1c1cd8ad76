"""Parts of the trajectories are made by processes of their own, and are the whole together."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.data.generation import generate
from slide_fmu.data.shards import Shard, shard_of
from slide_fmu.data.workplace import Workplace
from slide_fmu.recipe.recipe import SPLITS, RecipeError
from tests.data.test_generation import SMALL
from tests.progress import silent
from tests.recipes import tiny_recipe
from tests.store_digest import store_digest


@pytest.mark.parametrize("text", ["0/4", "5/4", "1", "1/0", "a/b", "-1/2", "1/2/3", ""])
def test_shard_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected I/N"):
        shard_of(text)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_shards_hold_every_trajectory_once_and_are_equal(count: int) -> None:
    sizes = {"train": 7, "validation": 0, "beyond": 4, "bound": 3}
    held: list[tuple[str, int]] = []
    parts = []
    for number in range(1, count + 1):
        before, part = 0, []
        for split, size in sizes.items():
            part += [(split, i) for i in Shard(number, count).indices(size, before)]
            before += size
        held += part
        parts.append(len(part))
    assert sorted(held) == sorted((split, i) for split, n in sizes.items() for i in range(n))
    assert max(parts) - min(parts) <= 1


def test_shards_make_their_parts_and_the_whole_finds_nothing_to_do(tmp_path: Path) -> None:
    path, total = tmp_path / "parts" / "s", sum(SMALL.count(split) for split in SPLITS)
    path.parent.mkdir()
    made = []
    for number in (2, 1, 3):
        shown: list[tuple[int, int]] = []
        shard = Shard(number, 3)
        made.append(generate(SMALL, path, None, lambda *n, to=shown: to.append(n), shard))
        assert shown[-1] == (made[-1], made[-1])
        assert generate(SMALL, path, None, silent, shard) == 0
    assert sum(made) == total
    assert max(made) - min(made) <= 1
    assert generate(SMALL, path, None, silent) == 0
    assert generate(SMALL, tmp_path / "s", None, silent) == total
    assert store_digest(path) == store_digest(tmp_path / "s")


@pytest.mark.parametrize(
    "place", [Workplace(0, shard=Shard(1, 2)), Workplace(executor="dask://127.0.0.1:9")]
)
def test_records_are_neither_made_in_parts_nor_elsewhere(tmp_path: Path, place: Workplace) -> None:
    recipe = tiny_recipe()
    system = recipe.system.model_copy(update={"kind": "record"})
    records = recipe.model_copy(update={"system": system})
    with pytest.raises(RecipeError, match=r"is of records.*neither --executor nor --shard"):
        place.make(records, None, tmp_path / "data.zarr", silent)
