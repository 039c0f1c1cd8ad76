"""This module prepares the store of a recipe, so that trajectories can be written to it.

It is created, or made longer. If a recipe changes the draws beyond the ranges, trajectories that
are drawn as before stay. A few lost or damaged trajectories are made again.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import zarr

from slide_fmu.core.figures import plain
from slide_fmu.core.files import writing
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.claims import claimed, locked
from slide_fmu.data.draws import split_stream
from slide_fmu.data.errors import StoreError
from slide_fmu.data.failures import failures_folder
from slide_fmu.data.fingerprint import Fingerprint, data_fingerprint, drawn_with
from slide_fmu.data.origin import require_origin
from slide_fmu.data.store import FORMAT, Store, open_store
from slide_fmu.data.stored_split import Shapes, create_split
from slide_fmu.recipe.recipe import SPLITS, Recipe

ROOM_PATIENCE = 60.0
"""Time in s to wait while other programs make room in a store, one after the other."""
MOST_READ = 10_000
"""A store with more finished trajectories is not read for damage: that would take minutes. The
training names a damaged one."""


def prepared_store(path: Path, recipe: Recipe, shapes: Shapes, probe: FloatArray) -> Store:
    """Create the store, or make room at ``path`` for further trajectories of the recipe.

    Trajectories that the recipe now draws with other factors are removed with their failures;
    others stay. A store that has room is not written to; several programs make room one after the
    other. A changed model is noticed by the outputs of its short motion,
    ``slide_fmu.data.draws.probe``.

    Raises:
        StoreError: the store is damaged, or was made from another recipe or model; nothing is
            changed.
        ClaimError: the disk cannot lock files.
        OSError: the store cannot be written; it names the path.
    """
    if not path.exists():
        _create_store(path, recipe, shapes, probe)
    store = open_store(path)
    require_origin(store, recipe, probe, redrawn=True)
    if _is_prepared(store, recipe):
        return store
    with locked(path.with_name(f".{path.name}.room"), ROOM_PATIENCE) as free:
        if not free:
            raise StoreError(
                f"{path}: another program has prepared this store for {ROOM_PATIENCE:g} s; "
                "expected a few seconds: see whether it hangs, and run the command again"
            )
        return _prepare(open_store(path), recipe)  # which another program may have changed


def _is_prepared(store: Store, recipe: Recipe) -> bool:
    """Tell whether a store names its origin, and has room for all trajectories of a recipe."""
    rooms = all(store.split(split).room() >= recipe.count(split) for split in SPLITS)
    return rooms and _origin_with(store, recipe) == store.fingerprint


def _origin_with(store: Store, recipe: Recipe) -> Fingerprint:
    """Return what a store was made from, with what it is made from now, which may be more."""
    found, wanted = store.fingerprint, data_fingerprint(recipe)
    estimator, bound = wanted.estimator or found.estimator, wanted.bound or found.bound
    return replace(wanted, estimator=estimator, bound=bound)


def _prepare(store: Store, recipe: Recipe) -> Store:
    origin = _origin_with(store, recipe)
    if origin != store.fingerprint:
        _forget_redrawn(store, recipe)
        store = store.with_origin(origin)
    for split in SPLITS:
        store.split(split).lengthen(recipe.count(split))
    return store


def _forget_redrawn(store: Store, recipe: Recipe) -> None:
    """Forget the trajectories that the recipe draws with other factors than the store did."""
    found = store.fingerprint
    estimating = recipe.estimator is not None and found.estimator is not None
    for split in ("beyond", *(("estimator", "estimator_validation") if estimating else ())):
        changed = [
            index
            for index in range(store.split(split).room())
            if drawn_with(found, split, index) != split_stream(recipe, split, index).factors
        ]
        forget_trajectories(store, split, changed)


def forget_trajectories(store: Store, split: str, indices: Sequence[int]) -> None:
    """Mark trajectories as missing and remove their failures, so that they are made again.

    Raises:
        OSError: the store cannot be written; it names the path.
    """
    store.split(split).forget(indices)
    for index in indices:
        for file in failures_folder(store.path).glob(f"{split}_{index}_*"):
            file.unlink(missing_ok=True)


def forget_damaged(store: Store, recipe: Recipe) -> None:
    """Mark the lost or damaged trajectories of a recipe as missing.

    Raises:
        StoreError: there are more than a few of them, so the store itself is damaged.
        ClaimError: the disk cannot lock files.
    """
    if sum(recipe.count(split) for split in SPLITS) > MOST_READ:
        return
    for split in SPLITS:
        stored, count = store.split(split), recipe.count(split)
        if count:
            stored.remove_damaged_flags()
        missing = set(stored.missing(count))
        done = [index for index in range(count) if index not in missing]
        for index in stored.damaged(done):
            with claimed(store.path, split, index) as free:
                if free:  # else another process makes it again
                    forget_trajectories(store, split, [index])


def _create_store(path: Path, recipe: Recipe, shapes: Shapes, probe: FloatArray) -> None:
    """Create a store under a temporary name, then rename it, so that no partial store exists.

    The first of several programs that do so wins; the others use its store. If this fails, the
    temporary store is removed.
    """
    stated = {
        "format": FORMAT,
        "fingerprint": plain(data_fingerprint(recipe)),
        "probe": probe.tolist(),
    }
    number = f"{os.getpid()}.{threading.get_ident()}"
    temporary = path.with_name(f"{path.name}.{number}")
    try:
        with writing(path):
            group = zarr.open_group(temporary, mode="w", attributes=stated)
            for split in SPLITS:
                create_split(group.create_group(split), recipe.count(split), shapes)
            temporary.rename(path)
    except OSError:
        if not path.exists():
            raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def remove_store(path: Path) -> None:
    """Remove a store, if there is one.

    It is renamed first, so that a partly removed store is never used.
    """
    doomed = path.with_name(f"{path.name}.removed")
    shutil.rmtree(doomed, ignore_errors=True)  # which a program that was killed may have left
    if path.exists():
        path.rename(doomed)
        shutil.rmtree(doomed)
