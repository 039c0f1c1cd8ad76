"""A few trajectories whose files are lost or damaged are made again, and all others stay."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.data.claims import claimed
from slide_fmu.data.shards import Shard
from slide_fmu.data.store import (
    damaged_trajectories,
    forget_trajectories,
    missing_trajectories,
    remove_damaged_flags,
)
from slide_fmu.recipe.recipe import SPLITS, Recipe

MOST_READ = 10_000
"""A store with more finished trajectories is not read for damage: that would take minutes. The
training names a damaged one."""


def forget_damaged(recipe: Recipe, path: Path, shard: Shard) -> None:
    """Take the trajectories of a shard that are lost or damaged for missing.

    Raises:
        StoreError: more than a few are, so the store itself is damaged.
        ClaimError: the disk cannot lock files.
    """
    if sum(recipe.count(split) for split in SPLITS) > MOST_READ:
        return
    before = 0
    for split in SPLITS:
        count = recipe.count(split)
        if count:
            remove_damaged_flags(path, split)
        missing = set(missing_trajectories(path, split, count, shard, before))
        done = [index for index in shard.indices(count, before) if index not in missing]
        for index in damaged_trajectories(path, split, done):
            with claimed(path, split, index) as free:
                if free:  # else another process makes it again
                    forget_trajectories(path, split, [index])
        before += count
