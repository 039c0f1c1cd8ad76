"""The trajectory store: one Zarr group per run, one chunk per trajectory.

Trajectories are written by several processes: each writes whole chunks of its own and sets the
trajectory's ``done`` flag last. A process that dies leaves a trajectory without its flag, which
is then made again.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from slide_fmu.recipe import SPLITS, Recipe
from slide_fmu.signals import FloatArray, Trajectory


class StoreError(ValueError):
    """The store on disk does not belong to the recipe, or is incomplete."""


@dataclass(frozen=True, eq=False)
class Split:
    """All trajectories of one split.

    Attributes:
        inputs: shape (n_trajectories, N, n_inputs), in the inputs' units.
        outputs: shape (n_trajectories, N + 1, n_outputs), in the outputs' units.
        kinds: index of each trajectory's excitation in the recipe, shape (n_trajectories,).
    """

    inputs: FloatArray
    outputs: FloatArray
    kinds: NDArray[np.int64]


@dataclass(frozen=True)
class Layout:
    """Shapes of the store's arrays."""

    n_samples: int
    n_inputs: int
    n_outputs: int


def data_fingerprint(recipe: Recipe) -> dict[str, Any]:
    """What the data depends on: a store made from other values is not used."""
    factor = None if recipe.estimator is None else recipe.estimator.amplitude_factor
    in_range = None if recipe.estimator is None else recipe.estimator.in_range
    fingerprint = {
        "system": recipe.system.model_dump(mode="json"),
        "step": recipe.window.step,
        "data": recipe.data.model_dump(mode="json"),
        "estimator": {"amplitude_factor": factor, "in_range": in_range},
    }
    return dict(json.loads(json.dumps(fingerprint)))


def open_store(path: Path, recipe: Recipe, layout: Layout) -> None:
    """Create the store, or check that the one at ``path`` belongs to the recipe.

    Raises:
        StoreError: the store was made from another recipe; nothing is changed.
    """
    fingerprint = data_fingerprint(recipe)
    if path.exists():
        difference = _first_difference(_read_fingerprint(path), fingerprint)
        if difference is not None:
            raise StoreError(
                f"{path} was generated from other values: {difference}; restore the recipe, or "
                "remove the store (or run with --overwrite) to generate again"
            )
        return
    temporary = path.with_name(path.name + ".new")
    group = zarr.open_group(temporary, mode="w", attributes={"fingerprint": fingerprint})
    for split in SPLITS:
        _create_split(group.create_group(split), recipe.data.count(split), layout)
    temporary.rename(path)


def missing_trajectories(path: Path, split: str) -> list[int]:
    """Indices of the split's trajectories that are not yet in the store."""
    done = np.asarray(_group(path, "r")[f"{split}/done"][:])
    return [int(index) for index in np.flatnonzero(done == 0)]


def write_trajectory(
    path: Path, split: str, index: int, trajectory: Trajectory, kind: int
) -> None:
    """Write one trajectory, its flag last. Other trajectories may be written at the same time."""
    group = _group(path, "r+")
    group[f"{split}/inputs"][index] = trajectory.inputs
    group[f"{split}/outputs"][index] = trajectory.outputs
    group[f"{split}/kinds"][index] = kind
    group[f"{split}/done"][index] = 1


def read_split(path: Path, split: str) -> Split:
    """Read all trajectories of a split.

    Raises:
        StoreError: there is no store, or trajectories are missing.
    """
    if not path.exists():
        raise StoreError(f"no data at {path}; generate it first (slide-fmu generate RECIPE)")
    missing = missing_trajectories(path, split)
    group = _group(path, "r")
    if missing:
        count = group[f"{split}/done"].shape[0]
        raise StoreError(
            f"{path}: {len(missing)} of {count} trajectories of split {split!r} are missing; "
            "generate again to complete it (slide-fmu generate RECIPE)"
        )
    return Split(
        np.asarray(group[f"{split}/inputs"][:]),
        np.asarray(group[f"{split}/outputs"][:]),
        np.asarray(group[f"{split}/kinds"][:], dtype=np.int64),
    )


def _group(path: Path, mode: Any) -> Any:
    return zarr.open_group(path, mode=mode)


def _read_fingerprint(path: Path) -> Any:
    try:
        return _group(path, "r").attrs.asdict()["fingerprint"]
    except (FileNotFoundError, KeyError) as error:
        raise StoreError(
            f"{path} is not a trajectory store; remove it and generate again"
        ) from error


def _create_split(group: Any, count: int, layout: Layout) -> None:
    n_samples = layout.n_samples
    shapes = {
        "inputs": (count, n_samples, layout.n_inputs),
        "outputs": (count, n_samples + 1, layout.n_outputs),
    }
    for name, shape in shapes.items():
        group.create_array(
            name, shape=shape, chunks=(1, *shape[1:]), dtype="float64", fill_value=np.nan
        )
    for name in ("kinds", "done"):
        group.create_array(name, shape=(count,), chunks=(1,), dtype="int8", fill_value=0)


def _first_difference(found: Any, wanted: Any, place: str = "") -> str | None:
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key in sorted({*found, *wanted}):
            name = f"{place}.{key}" if place else str(key)
            difference = _first_difference(found.get(key), wanted.get(key), name)
            if difference is not None:
                return difference
        return None
    return None if found == wanted else f"{place} = {found!r} there, {wanted!r} in the recipe"
