"""The trajectory store is one Zarr group per run, with one chunk per trajectory.

Several processes write trajectories at once: each writes whole chunks of its own and sets the
trajectory's ``done`` flag last. A process that dies leaves a trajectory without its flag, which
is then made again. The store keeps a fingerprint of the recipe and a short motion of the model, so
that data of other values, or of a model that has changed since, is refused. Where a recipe changes
how far inputs leave their ranges, the trajectories that are drawn as before stay.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import Crc32cCodec, ZstdCodec

from slide_fmu.core.files import writing
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.data.claims import locked
from slide_fmu.data.draws import split_stream
from slide_fmu.data.errors import StoreError
from slide_fmu.data.failures import failures_folder
from slide_fmu.data.fingerprint import (
    data_fingerprint,
    drawn_with,
    first_difference,
    same_kinds_of_draws,
    same_motion,
)
from slide_fmu.data.shards import WHOLE, Shard
from slide_fmu.recipe.measured import KIND
from slide_fmu.recipe.recipe import SPLITS, Recipe

FORMAT = 1
"""Stores of other formats are refused: it is raised when the fingerprint of a recipe has other
keys."""

READ_AT_ONCE, FEW = 64, 3
"""So many trajectories are read at once to see whether they are whole. Where not so many, and not
more than half, are damaged, these are made again; more are damage of the store itself."""

ROOM_PATIENCE = 60.0
"""Time in s in which other programs make room in a store, one after the other."""


@dataclass(frozen=True, eq=False)
class Split:
    """A split holds trajectories of equal length, as arrays.

    Attributes:
        inputs: inputs in their units, shape (n_trajectories, N, n_inputs).
        outputs: outputs in their units, shape (n_trajectories, N + 1, n_outputs).
        kinds: index of each trajectory's excitation in the recipe's mix, or of its file among
            those of records, shape (n_trajectories,).
        parameters: values of each trajectory's physical parameters, in their units, shape
            (n_trajectories, n_parameters); None where the recipe has none.
    """

    inputs: FloatArray
    outputs: FloatArray
    kinds: NDArray[np.int64]
    parameters: FloatArray | None = None


Shapes = dict[str, tuple[int, ...]]
"""Shapes of a trajectory's ``inputs``, (N, n_inputs), ``outputs``, (N + 1, n_outputs), and, where
there are physical parameters, of these, (n_parameters,)."""


def open_store(path: Path, recipe: Recipe, shapes: Shapes, probe: FloatArray) -> None:
    """Create the store, or make room at ``path`` for the trajectories that the recipe has more.

    Trajectories that the recipe draws with other factors than before are missing then, and so are
    their failures; others stay. A store that has room is not written to; several programs take
    turns to make some. A changed model is noticed by the outputs of its short motion,
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
                f"{path}: another program has made room there for {ROOM_PATIENCE:g} s; expected "
                "some seconds at most: see whether it hangs, and do the same again"
            )
        for make in _lacks(path, recipe, shapes):
            make()


def _lacks(path: Path, recipe: Recipe, shapes: Shapes) -> list[Callable[[], None]]:
    """List what is to be done so that a store has room for all trajectories of a recipe.

    It also names what the store was made from, which may be more now.
    """
    found = _attributes(path)["fingerprint"]
    both = {**found, **data_fingerprint(recipe)}
    lacks: list[Callable[[], None]] = []
    if both != found:
        lacks = [partial(_forget_redrawn, path, recipe), partial(_name_origin, path, both)]
    for split in SPLITS:
        count = recipe.count(split)
        with _damage_reported(path, split):
            group = _group(path, "r")
            for name in (*shapes, "kinds", "done"):
                if group[f"{split}/{name}"].shape[0] < count:
                    lacks.append(partial(_lengthen, path, split, name, count))
    return lacks


def _forget_redrawn(path: Path, recipe: Recipe) -> None:
    """Forget the trajectories that the recipe draws with other factors than the store did."""
    found = _attributes(path)["fingerprint"]
    estimating = recipe.estimator is not None and "estimator" in found
    for split in ("beyond", *(("estimator", "estimator_validation") if estimating else ())):
        with _damage_reported(path, split):
            room = range(_group(path, "r")[f"{split}/done"].shape[0])
        changed = [
            index
            for index in room
            if drawn_with(found, split, index) != split_stream(recipe, split, index).factors
        ]
        forget_trajectories(path, split, changed)


def forget_trajectories(path: Path, split: str, indices: Sequence[int]) -> None:
    """Take trajectories for missing, with their failures, so that they are made again.

    Raises:
        OSError: the store cannot be written; it names the path.
    """
    with writing(path), _damage_reported(path, split):
        group = _group(path, "r+")
        for index in indices:
            group[f"{split}/done"][index] = 0
            for file in failures_folder(path).glob(f"{split}_{index}_*"):
                file.unlink(missing_ok=True)


def _name_origin(path: Path, fingerprint: dict[str, Any]) -> None:
    with writing(path):
        _group(path, "r+").attrs["fingerprint"] = fingerprint


def _lengthen(path: Path, split: str, name: str, count: int) -> None:
    with writing(path), _damage_reported(path, split):
        array = _group(path, "r+")[f"{split}/{name}"]
        array.resize((count, *array.shape[1:]))


def _create_store(path: Path, recipe: Recipe, shapes: Shapes, probe: FloatArray) -> None:
    """Create a store beside its place, then move it there: a store is whole or not there.

    The first of several programs that do so wins; the others use its store. Nothing is left beside
    its place where that fails.
    """
    attributes = {
        "format": FORMAT,
        "fingerprint": data_fingerprint(recipe),
        "probe": probe.tolist(),
    }
    number = f"{os.getpid()}.{threading.get_ident()}"
    temporary = path.with_name(f"{path.name}.{number}")
    try:
        with writing(path):
            group = zarr.open_group(temporary, mode="w", attributes=attributes)
            for split in SPLITS:
                _create_split(group.create_group(split), recipe.count(split), shapes)
            temporary.rename(path)
    except OSError:
        if not path.exists():
            raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def require_origin(path: Path, recipe: Recipe, probe: FloatArray, redrawn: bool = False) -> None:
    """Refuse a store that was made from another recipe, or from a model that has changed since.

    Recipes with and without error estimator may share a store. The probe is as of ``open_store``,
    after which inputs may leave their ranges otherwise than before: these are ``redrawn``.

    Raises:
        StoreError: there is no store, a value differs (the message names the first that does), or
            the model gives other outputs.
    """
    if not path.exists():
        raise StoreError(_nothing(path))
    attributes, wanted = _attributes(path), data_fingerprint(recipe)
    found = attributes["fingerprint"]
    # a store without trajectories for an estimator, or of the bound's own kinds, gets them later,
    # in streams of their own
    for one, other in ((found, wanted), (wanted, found)):
        for table in ("estimator", "bound"):
            if table not in one:
                other.pop(table, None)
    _require_same_values(path, found, wanted, redrawn)
    known = np.array(attributes["probe"])
    if recipe.system.is_record:
        _require_same_records(path, recipe, known, probe)
    elif not same_motion(known, probe):
        raise StoreError(
            f"{path}: {recipe.system.model!r} does not give the motions any more that are stored "
            "here; the model has changed since: generate again (slide-fmu generate RECIPE "
            "--overwrite)"
        )


def _require_same_records(path: Path, recipe: Recipe, known: FloatArray, now: FloatArray) -> None:
    """Refuse files of records, one row for each, that have changed since they were stored."""
    files = (recipe.system.model, *recipe.system.further)
    others = [files[row] for row in np.flatnonzero((known != now).any(axis=1))]
    if others:
        raise StoreError(
            f"{path}: {', '.join(others)} has changed since its samples were stored here; "
            "expected the same content: restore it, or generate again (slide-fmu generate RECIPE "
            "--overwrite)"
        )


def _require_same_values(
    path: Path, found: dict[str, Any], wanted: dict[str, Any], redrawn: bool
) -> None:
    """Refuse fingerprints that differ, or differ in more than what is redrawn."""
    same, command = same_kinds_of_draws, "slide-fmu generate RECIPE --overwrite"
    difference = first_difference(same(found), same(wanted))
    if difference is None and not redrawn:
        difference = first_difference(found, wanted)
        command = (
            "slide-fmu generate RECIPE, which keeps the trajectories that are drawn as before"
        )
    if difference is not None:
        raise StoreError(
            f"{path} was generated from other values: {difference}; restore the recipe, or "
            f"generate again ({command})"
        )


def require_motion(path: Path, probe: FloatArray, where: str) -> None:
    """Refuse a model that does not give the short motion of the store's at another place.

    Raises:
        StoreError: the motions differ; the message begins with the place.
    """
    if not same_motion(np.array(_attributes(path)["probe"]), probe):
        raise StoreError(
            f"{where} simulates another motion than the machine where {path} was made; expected "
            "the same model there: install the same packages, and begin the workers anew"
        )


def remove_store(path: Path) -> None:
    """Remove a store, if there is one.

    It is renamed first, so that a store that is removed in part is never taken for a store.
    """
    doomed = path.with_name(f"{path.name}.removed")
    shutil.rmtree(doomed, ignore_errors=True)
    if path.exists():
        path.rename(doomed)
        shutil.rmtree(doomed)


def missing_trajectories(
    path: Path, split: str, count: int | None = None, shard: Shard = WHOLE, before: int = 0
) -> list[int]:
    """List indices of the split's first ``count`` trajectories that are not in the store, rising.

    Without a count these are all that the store has room for. Of a shard only its own are looked
    for; ``before`` is the number of trajectories in all splits before this one.

    Raises:
        StoreError: the store is damaged.
    """
    with _damage_reported(path, split):
        group = _group(path, "r")
        flags = group[f"{split}/done"]
        wanted = shard.indices(flags.shape[0] if count is None else count, before)
        # a listing takes seconds where a million reads take minutes
        written = _written(path, flags)
        there = [index for index in wanted if index in written]
        done = dict(zip(there, _read(flags, there), strict=True))
    return [index for index in wanted if not done.get(index)]


def remove_damaged_flags(path: Path, split: str) -> None:
    """Remove the flags of a split that cannot be read: their trajectories count as missing.

    Raises:
        StoreError: the store is damaged otherwise.
    """
    with _damage_reported(path, split):
        group = _group(path, "r")
        flags = group[f"{split}/done"]
        there = sorted(_written(path, flags))
        with contextlib.suppress(RuntimeError, ValueError):
            _read(flags, there)
            return
        for index in there:
            try:
                flags[index]
            except (RuntimeError, ValueError):
                (path / flags.path / flags.metadata.encode_chunk_key((index,))).unlink()


def _written(path: Path, flags: Any) -> set[int]:
    """Return the indices of all flags that were ever written, set or not."""
    place = path / flags.path / flags.metadata.encode_chunk_key((0,))
    if not place.parent.is_dir():
        return set()
    return {int(name) for name in os.listdir(place.parent) if name.isdigit()}


def is_done(path: Path, split: str, index: int) -> bool:
    """Tell whether a trajectory is in the store."""
    with _damage_reported(path, split):
        return bool(_group(path, "r")[f"{split}/done"][index])


def write_trajectory(
    path: Path,
    split: str,
    index: int,
    trajectory: Trajectory,
    kind: int,
    parameters: FloatArray | None = None,
) -> None:
    """Write one trajectory, its flag last; others may be written at the same time.

    The index counts from 0 in the split; ``kind`` is as of ``Split.kinds``. The parameters,
    (n_parameters,), are given where the recipe has some.

    Raises:
        OSError: the trajectory cannot be written; it names the store.
    """
    with writing(path):
        group = _group(path, "r+")
        group[f"{split}/inputs"][index] = trajectory.inputs
        group[f"{split}/outputs"][index] = trajectory.outputs
        group[f"{split}/kinds"][index] = kind
        if parameters is not None:
            group[f"{split}/parameters"][index] = parameters
        group[f"{split}/done"][index] = 1


def require_trajectories(path: Path, recipe: Recipe) -> None:
    """Refuse a store that lacks trajectories of a recipe, before anything is learnt from others.

    Raises:
        StoreError: there is no store, trajectories are missing, or it is damaged.
    """
    if not path.exists():
        raise StoreError(_nothing(path))
    for split in SPLITS:
        count = recipe.count(split)
        missing = missing_trajectories(path, split, count) if count else []
        if missing:
            raise StoreError(_incomplete(path, split, len(missing), count))


def _nothing(path: Path) -> str:
    return f"no data at {path}; generate it first (slide-fmu generate RECIPE)"


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
    if not path.exists():
        raise StoreError(_nothing(path))
    missing = missing_trajectories(path, split, count)
    group = _group(path, "r")
    if missing:
        wanted = group[f"{split}/done"].shape[0] if count is None else count
        raise StoreError(_incomplete(path, split, len(missing), wanted))
    with _damage_reported(path, split):
        has_parameters = f"{split}/parameters" in group
        names = ("inputs", "outputs", "kinds", *(["parameters"] if has_parameters else []))
        rows = range(group[f"{split}/done"].shape[0] if count is None else count)
        found = {name: _read(group[f"{split}/{name}"], rows) for name in names}
        broken = np.flatnonzero(~_are_whole(path, found))
        if broken.size:
            raise ValueError(f"trajectory {broken[0]} is not whole")
        return Split(kinds=found.pop("kinds").astype(np.int64), **found)


def _are_whole(path: Path, found: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Tell which trajectories, read from a split's arrays by name, are whole, shape (n,).

    A chunk whose file is lost reads as the fill value, which is not a number.
    """
    measured = _attributes(path)["fingerprint"]["system"].get("kind") == KIND
    whole = np.ones(len(found["kinds"]), dtype=bool)
    for name in found.keys() - {"kinds"}:
        # measured outputs may be missing before those that are scored, but not all of them
        enough = np.any if measured and name == "outputs" else np.all
        whole &= enough(np.isfinite(found[name]), axis=tuple(range(1, found[name].ndim)))
    return whole


def damaged_trajectories(path: Path, split: str, indices: Sequence[int]) -> list[int]:
    """List those of finished trajectories of which a file is missing or damaged, rising.

    Raises:
        StoreError: it is more than the files of a few trajectories.
    """
    damaged: list[int] = []
    with _damage_reported(path, split):
        group = _group(path, "r")
        names = [
            n for n in ("inputs", "outputs", "kinds", "parameters") if f"{split}/{n}" in group
        ]
        arrays = {name: group[f"{split}/{name}"] for name in names}
        for first in range(0, len(indices), READ_AT_ONCE):
            rows = indices[first : first + READ_AT_ONCE]
            try:
                found = {name: _read(array, rows) for name, array in arrays.items()}
                broken = [
                    row for row, w in zip(rows, _are_whole(path, found), strict=True) if not w
                ]
            except (RuntimeError, ValueError):
                broken = [row for row in rows if not _is_whole(path, arrays, row)]
            damaged += broken
        if len(damaged) > max(FEW, len(indices) // 2):
            raise ValueError(f"{len(damaged)} of {len(indices)} trajectories cannot be read")
    return damaged


def _is_whole(path: Path, arrays: dict[str, Any], row: int) -> bool:
    try:
        found = {name: _read(array, [row]) for name, array in arrays.items()}
        return bool(_are_whole(path, found).all())
    except (RuntimeError, ValueError):
        return False


@contextlib.contextmanager
def _damage_reported(path: Path, split: str) -> Iterator[None]:
    """Turn what Zarr raises on damaged files into a StoreError with the remedy."""
    try:
        yield
    except (RuntimeError, ValueError, KeyError, TypeError) as error:
        raise StoreError(
            f"{path}: a file of split {split!r} is damaged or missing ({error}); generate again "
            "(slide-fmu generate RECIPE makes a damaged trajectory alone again, and with "
            "--overwrite all of them)"
        ) from error


def _read(array: Any, rows: Sequence[int]) -> NDArray[Any]:
    """Read some of an array's rows, one chunk each.

    Raises:
        ValueError: a chunk is damaged, or the description of the array; the message names its
            file.
    """
    if array.chunks != (1, *array.shape[1:]):  # descriptions have no checksums, as chunks have
        raise ValueError(
            f"{array.basename}/zarr.json: chunks of {array.chunks} in an array of {array.shape}"
        )
    try:
        if isinstance(rows, range) and rows.step == 1:
            return np.asarray(array[rows.start : rows.stop])
        return np.asarray(array.oindex[np.array(rows, dtype=np.int64)])
    except (RuntimeError, ValueError) as error:
        for index in rows:
            try:
                array[index]
            except (RuntimeError, ValueError) as cause:
                file = array.metadata.encode_chunk_key((index, *[0] * (array.ndim - 1)))
                raise ValueError(f"{array.basename}/{file}: {cause}") from error
        raise


def _group(path: Path, mode: Any) -> Any:
    return zarr.open_group(path, mode=mode)


def _attributes(path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = dict(_group(path, "r").attrs.asdict())
        if "fingerprint" in found and found.get("format") != FORMAT:
            raise StoreError(
                f"{path} was made by another version of slide-fmu; generate again (slide-fmu "
                "generate RECIPE --overwrite), or use the version that made it"
            )
        np.array(found["probe"], dtype=np.float64)
        tables = [found["fingerprint"][name] for name in ("data", "system")]
        if not all(isinstance(table, dict) for table in tables):
            raise TypeError("its recipe has no tables")
    except StoreError:
        raise
    except (FileNotFoundError, LookupError, TypeError, ValueError) as error:
        raise StoreError(
            f"{path} is not a trajectory store, or a damaged one ({error}); remove it and "
            "generate again"
        ) from error
    return found


def _create_split(group: Any, count: int, shapes: Shapes) -> None:
    """Create the arrays of a split: not a number where nothing is written, and no flag set.

    Every chunk ends with its checksum, so that a damaged one is not read.
    """
    kept = {"compressors": [ZstdCodec(), Crc32cCodec()]}
    for name, shape in shapes.items():
        group.create_array(
            name,
            shape=(count, *shape),
            chunks=(1, *shape),
            dtype="float64",
            fill_value=np.nan,
            **kept,
        )
    # there may be hundreds of files of records
    for name, dtype in (("kinds", "int32"), ("done", "int8")):
        group.create_array(name, shape=(count,), chunks=(1,), dtype=dtype, fill_value=0, **kept)
