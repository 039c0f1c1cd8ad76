"""The trajectory store is one Zarr group per run, with one chunk per trajectory.

Several processes write trajectories at once: each writes whole chunks of its own and sets the
trajectory's ``done`` flag last. A process that dies leaves a trajectory without its flag, which
is then made again. The store keeps a fingerprint of the recipe and a short motion of the model, so
that data of other values, or of a model that has changed since, is refused. If a recipe changes
the draws beyond the ranges, trajectories that are drawn as before stay.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import zarr

from slide_fmu.core.figures import plain
from slide_fmu.core.files import writing
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.claims import locked
from slide_fmu.data.draws import split_stream
from slide_fmu.data.errors import StoreError
from slide_fmu.data.failures import failures_folder
from slide_fmu.data.fingerprint import Fingerprint, data_fingerprint, drawn_with
from slide_fmu.data.origin import require_origin
from slide_fmu.data.zarr_group import (
    FORMAT,
    Shapes,
    attributes,
    create_split,
    damage_reported,
    open_group,
)
from slide_fmu.recipe.recipe import SPLITS, Recipe

ROOM_PATIENCE = 60.0
"""Time in s to wait while other programs make room in a store, one after the other."""


def open_store(path: Path, recipe: Recipe, shapes: Shapes, probe: FloatArray) -> None:
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
    require_origin(path, recipe, probe, redrawn=True)
    if not _lacks(path, recipe, shapes):
        return
    with locked(path.with_name(f".{path.name}.room"), ROOM_PATIENCE) as free:
        if not free:
            raise StoreError(
                f"{path}: another program has prepared this store for {ROOM_PATIENCE:g} s; "
                "expected a few seconds: see whether it hangs, and run the command again"
            )
        for make in _lacks(path, recipe, shapes):
            make()


def _lacks(path: Path, recipe: Recipe, shapes: Shapes) -> list[Callable[[], None]]:
    """List what is to be done so that a store has room for all trajectories of a recipe.

    It also names what the store was made from, which may be more now.
    """
    found, wanted = attributes(path).fingerprint, data_fingerprint(recipe)
    estimator, bound = wanted.estimator or found.estimator, wanted.bound or found.bound
    both = replace(wanted, estimator=estimator, bound=bound)
    lacks: list[Callable[[], None]] = []
    if both != found:
        lacks = [partial(_forget_redrawn, path, recipe), partial(_name_origin, path, both)]
    for split in SPLITS:
        count = recipe.count(split)
        with damage_reported(path, split):
            group = open_group(path, "r")
            for name in (*shapes, "kinds", "done"):
                if group[f"{split}/{name}"].shape[0] < count:
                    lacks.append(partial(_lengthen, path, split, name, count))
    return lacks


def _forget_redrawn(path: Path, recipe: Recipe) -> None:
    """Forget the trajectories that the recipe draws with other factors than the store did."""
    found = attributes(path).fingerprint
    estimating = recipe.estimator is not None and found.estimator is not None
    for split in ("beyond", *(("estimator", "estimator_validation") if estimating else ())):
        with damage_reported(path, split):
            room = range(open_group(path, "r")[f"{split}/done"].shape[0])
        changed = [
            index
            for index in room
            if drawn_with(found, split, index) != split_stream(recipe, split, index).factors
        ]
        forget_trajectories(path, split, changed)


def forget_trajectories(path: Path, split: str, indices: Sequence[int]) -> None:
    """Mark trajectories as missing and remove their failures, so that they are made again.

    Raises:
        OSError: the store cannot be written; it names the path.
    """
    with writing(path), damage_reported(path, split):
        group = open_group(path, "r+")
        for index in indices:
            group[f"{split}/done"][index] = 0
            for file in failures_folder(path).glob(f"{split}_{index}_*"):
                file.unlink(missing_ok=True)


def _name_origin(path: Path, fingerprint: Fingerprint) -> None:
    with writing(path):
        open_group(path, "r+").attrs["fingerprint"] = plain(fingerprint)


def _lengthen(path: Path, split: str, name: str, count: int) -> None:
    with writing(path), damage_reported(path, split):
        array = open_group(path, "r+")[f"{split}/{name}"]
        array.resize((count, *array.shape[1:]))


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
    shutil.rmtree(doomed, ignore_errors=True)
    if path.exists():
        path.rename(doomed)
        shutil.rmtree(doomed)
