"""This module writes trajectories to a store one by one, and reads them by split.

Several processes write trajectories at once: each writes whole chunks of its own and sets the
trajectory's ``done`` flag last. A process that dies leaves a trajectory without its flag, which
is then made again.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.files import writing
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.data.errors import StoreError
from slide_fmu.data.zarr_group import (
    attributes,
    damage_reported,
    open_group,
    read_rows,
    require_store,
)
from slide_fmu.recipe.model_rules import rules_of_tables
from slide_fmu.recipe.recipe import SPLITS, Recipe


@dataclass(frozen=True, eq=False)
class Split:
    """A split holds trajectories of equal length, as arrays.

    Attributes:
        inputs: inputs in their units, shape (n_trajectories, N, n_inputs).
        outputs: outputs in their units, shape (n_trajectories, N + 1, n_outputs).
        kinds: index of each trajectory's excitation in the recipe's mix, or of its record file,
            shape (n_trajectories,).
        parameters: values of each trajectory's physical parameters, in their units, shape
            (n_trajectories, n_parameters); None without parameters.
    """

    inputs: FloatArray
    outputs: FloatArray
    kinds: NDArray[np.int64]
    parameters: FloatArray | None = None


def is_done(path: Path, split: str, index: int) -> bool:
    """Tell whether a trajectory is in the store."""
    with damage_reported(path, split):
        return bool(open_group(path, "r")[f"{split}/done"][index])


def write_trajectory(
    path: Path,
    split: str,
    index: int,
    trajectory: Trajectory,
    kind: int,
    parameters: FloatArray | None = None,
) -> None:
    """Write one trajectory, its flag last; others may be written at the same time.

    The index counts from 0 in the split; ``kind`` is as in ``Split.kinds``. The parameters,
    (n_parameters,), are given if the recipe has some.

    Raises:
        OSError: the trajectory cannot be written; it names the store.
    """
    with writing(path):
        group = open_group(path, "r+")
        group[f"{split}/inputs"][index] = trajectory.inputs
        group[f"{split}/outputs"][index] = trajectory.outputs
        group[f"{split}/kinds"][index] = kind
        if parameters is not None:
            group[f"{split}/parameters"][index] = parameters
        group[f"{split}/done"][index] = 1


def missing_trajectories(path: Path, split: str, count: int | None = None) -> list[int]:
    """List indices of the split's first ``count`` trajectories that are not in the store, rising.

    Without a count, all trajectories that the store has room for are checked.

    Raises:
        StoreError: the store is damaged.
    """
    with damage_reported(path, split):
        group = open_group(path, "r")
        flags = group[f"{split}/done"]
        wanted = range(flags.shape[0] if count is None else count)
        # a listing takes seconds where a million reads take minutes
        written = written_flags(path, flags)
        there = [index for index in wanted if index in written]
        done = dict(zip(there, read_rows(flags, there), strict=True))
    return [index for index in wanted if not done.get(index)]


def written_flags(path: Path, flags: Any) -> set[int]:
    """Return the indices of all flags that were ever written, set or not."""
    place = path / flags.path / flags.metadata.encode_chunk_key((0,))
    if not place.parent.is_dir():
        return set()
    return {int(name) for name in os.listdir(place.parent) if name.isdigit()}


def require_trajectories(path: Path, recipe: Recipe) -> None:
    """Refuse a store that lacks trajectories of a recipe, before anything is learnt from others.

    Raises:
        StoreError: there is no store, trajectories are missing, or it is damaged.
    """
    require_store(path)
    for split in SPLITS:
        count = recipe.count(split)
        missing = missing_trajectories(path, split, count) if count else []
        if missing:
            raise StoreError(_incomplete(path, split, len(missing), count))


def _incomplete(path: Path, split: str, missing: int, wanted: int) -> str:
    return (
        f"{path}: {missing} of {wanted} trajectories of split {split!r} are missing; "
        "generate again to complete it (slide-fmu generate RECIPE)"
    )


def read_split(path: Path, split: str, count: int | None = None) -> Split:
    """Read the first ``count`` trajectories of a split; all that the store has room for if None.

    Raises:
        StoreError: there is no store, trajectories are missing, or a file is damaged.
    """
    require_store(path)
    missing = missing_trajectories(path, split, count)
    group = open_group(path, "r")
    if missing:
        wanted = group[f"{split}/done"].shape[0] if count is None else count
        raise StoreError(_incomplete(path, split, len(missing), wanted))
    with damage_reported(path, split):
        has_parameters = f"{split}/parameters" in group
        names = ("inputs", "outputs", "kinds", *(["parameters"] if has_parameters else []))
        rows = range(group[f"{split}/done"].shape[0] if count is None else count)
        found = {name: read_rows(group[f"{split}/{name}"], rows) for name in names}
        broken = np.flatnonzero(~are_whole(path, found))
        if broken.size:
            raise ValueError(f"trajectory {broken[0]} is not whole")
        return Split(kinds=found.pop("kinds").astype(np.int64), **found)


def are_whole(path: Path, found: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Tell which trajectories, read from a split's arrays by name, are whole, shape (n,).

    A chunk whose file is lost is read as the fill value NaN.
    """
    rules = rules_of_tables({"system": attributes(path).fingerprint.system})
    whole = np.ones(len(found["kinds"]), dtype=bool)
    for name in found.keys() - {"kinds"}:
        # outputs of records may be missing before the scored samples, but not all of them
        enough = np.any if rules.lacks_outputs and name == "outputs" else np.all
        whole &= enough(np.isfinite(found[name]), axis=tuple(range(1, found[name].ndim)))
    return whole
