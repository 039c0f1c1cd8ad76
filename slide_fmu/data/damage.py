"""This module finds a few lost or damaged trajectories, which are then made again."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from slide_fmu.data.claims import claimed
from slide_fmu.data.store import forget_trajectories
from slide_fmu.data.trajectories import are_whole, missing_trajectories, written_flags
from slide_fmu.data.zarr_group import damage_reported, open_group, read_rows
from slide_fmu.recipe.recipe import SPLITS, Recipe

MOST_READ = 10_000
"""A store with more finished trajectories is not read for damage: that would take minutes. The
training names a damaged one."""

READ_AT_ONCE, FEW = 64, 3
"""READ_AT_ONCE trajectories are read at once to check them. The store itself counts as damaged if
FEW or more trajectories, or more than half of them, are damaged; fewer are made again."""


def forget_damaged(recipe: Recipe, path: Path) -> None:
    """Mark the lost or damaged trajectories of a recipe as missing.

    Raises:
        StoreError: there are more than a few of them, so the store itself is damaged.
        ClaimError: the disk cannot lock files.
    """
    if sum(recipe.count(split) for split in SPLITS) > MOST_READ:
        return
    for split in SPLITS:
        count = recipe.count(split)
        if count:
            remove_damaged_flags(path, split)
        missing = set(missing_trajectories(path, split, count))
        done = [index for index in range(count) if index not in missing]
        for index in damaged_trajectories(path, split, done):
            with claimed(path, split, index) as free:
                if free:  # else another process makes it again
                    forget_trajectories(path, split, [index])


def damaged_trajectories(path: Path, split: str, indices: Sequence[int]) -> list[int]:
    """List finished trajectories with a missing or damaged file, in rising order.

    Raises:
        StoreError: there are more than a few of them.
    """
    damaged: list[int] = []
    with damage_reported(path, split):
        group = open_group(path, "r")
        names = [
            n for n in ("inputs", "outputs", "kinds", "parameters") if f"{split}/{n}" in group
        ]
        arrays = {name: group[f"{split}/{name}"] for name in names}
        for first in range(0, len(indices), READ_AT_ONCE):
            rows = indices[first : first + READ_AT_ONCE]
            try:
                found = {name: read_rows(array, rows) for name, array in arrays.items()}
                broken = [
                    row for row, w in zip(rows, are_whole(path, found), strict=True) if not w
                ]
            except (RuntimeError, ValueError):
                broken = [row for row in rows if not _is_whole(path, arrays, row)]
            damaged += broken
        if len(damaged) > max(FEW, len(indices) // 2):
            raise ValueError(f"{len(damaged)} of {len(indices)} trajectories cannot be read")
    return damaged


def _is_whole(path: Path, arrays: Mapping[str, Any], row: int) -> bool:
    try:
        found = {name: read_rows(array, [row]) for name, array in arrays.items()}
        return bool(are_whole(path, found).all())
    except (RuntimeError, ValueError):
        return False


def remove_damaged_flags(path: Path, split: str) -> None:
    """Remove the flags of a split that cannot be read: their trajectories count as missing.

    Raises:
        StoreError: the store is damaged otherwise.
    """
    with damage_reported(path, split):
        group = open_group(path, "r")
        flags = group[f"{split}/done"]
        there = sorted(written_flags(path, flags))
        with contextlib.suppress(RuntimeError, ValueError):
            read_rows(flags, there)
            return
        for index in there:
            try:
                flags[index]
            except (RuntimeError, ValueError):
                (path / flags.path / flags.metadata.encode_chunk_key((index,))).unlink()
