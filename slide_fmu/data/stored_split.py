"""A split of a store holds trajectories in arrays of a Zarr group, with one chunk per trajectory.

Several processes write trajectories at once: each writes whole chunks of its own and sets the
trajectory's ``done`` flag last. A process that dies leaves a trajectory without its flag, which
is then made again. Exceptions of Zarr for damaged files become a StoreError here.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import Crc32cCodec, ZstdCodec

from slide_fmu.core.files import writing
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.data.errors import StoreError

Shapes = dict[str, tuple[int, ...]]
"""Shapes of a trajectory's ``inputs``, (N, n_inputs), ``outputs``, (N + 1, n_outputs), and, where
there are physical parameters, of these, (n_parameters,)."""

READ_AT_ONCE, FEW = 64, 3
"""READ_AT_ONCE trajectories are read at once to check them. The store itself counts as damaged if
more than FEW trajectories, and more than half of them, are damaged; fewer are made again."""


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


@final
@dataclass(frozen=True, eq=False)
class StoredSplit:
    """A StoredSplit reads and writes one split of a store.

    Every method raises a StoreError where a file is damaged, and an OSError that names the store
    where it cannot be written.

    Attributes:
        path: folder of the store.
        name: name of the split.
        group: the store's Zarr group, for reading.
        lacks_outputs: whether a trajectory may lack some of its outputs, as those of records may
            before the scored samples.
    """

    path: Path
    name: str
    group: Any
    lacks_outputs: bool

    def room(self) -> int:
        """Return the number of trajectories that the split has room for."""
        with self._damage_reported():
            return min(int(self._array(name).shape[0]) for name in (*self._names(), "done"))

    def lengthen(self, count: int) -> None:
        """Make room for this number of trajectories; a split that has room is not written to."""
        with writing(self.path), self._damage_reported():
            for name in (*self._names(), "done"):
                if self._array(name).shape[0] < count:
                    array = self._opened_to_write()[name]
                    array.resize((count, *array.shape[1:]))

    def is_done(self, index: int) -> bool:
        """Tell whether a trajectory is in the store."""
        with self._damage_reported():
            return bool(self._array("done")[index])

    def write(
        self, index: int, trajectory: Trajectory, kind: int, parameters: FloatArray | None = None
    ) -> None:
        """Write one trajectory, its flag last; others may be written at the same time.

        The index counts from 0; ``kind`` is as in ``Split.kinds``. The parameters,
        (n_parameters,), are given if the recipe has some.
        """
        values = {"inputs": trajectory.inputs, "outputs": trajectory.outputs, "kinds": kind}
        if parameters is not None:
            values["parameters"] = parameters
        with writing(self.path):
            arrays = self._opened_to_write()
            for name, value in (*values.items(), ("done", 1)):
                arrays[name][index] = value

    def forget(self, indices: Sequence[int]) -> None:
        """Mark trajectories as missing, so that they are made again."""
        with writing(self.path), self._damage_reported():
            flags = self._opened_to_write()["done"]
            for index in indices:
                flags[index] = 0

    def missing(self, count: int | None = None) -> list[int]:
        """List indices of the first ``count`` trajectories that are not in the store, rising.

        Without a count, all trajectories that the store has room for are checked.
        """
        with self._damage_reported():
            flags = self._array("done")
            wanted = range(flags.shape[0] if count is None else count)
            # a listing takes seconds where a million reads take minutes
            written = self._written_flags(flags)
            there = [index for index in wanted if index in written]
            done = dict(zip(there, _read_rows(flags, there), strict=True))
        return [index for index in wanted if not done.get(index)]

    def require(self, count: int) -> None:
        """Refuse a split that lacks some of its first trajectories.

        Raises:
            StoreError: it lacks some; the message has their number.
        """
        missing = self.missing(count)
        if missing:
            raise StoreError(
                f"{self.path}: {len(missing)} of {count} trajectories of split {self.name!r} are "
                "missing; generate again to complete it (slide-fmu generate RECIPE)"
            )

    def read(self, count: int | None = None) -> Split:
        """Read the first ``count`` trajectories; all that the store has room for if None.

        Raises:
            StoreError: trajectories are missing, or a file is damaged.
        """
        count = self.room() if count is None else count
        self.require(count)
        with self._damage_reported():
            found, whole = self._rows(range(count))
            if not whole.all():
                raise ValueError(f"trajectory {np.argmin(whole)} is not whole")
            return Split(kinds=found.pop("kinds").astype(np.int64), **found)

    def damaged(self, indices: Sequence[int]) -> list[int]:
        """List finished trajectories with a missing or damaged file, in rising order.

        Raises:
            StoreError: there are more than a few of them.
        """
        damaged: list[int] = []
        with self._damage_reported():
            for first in range(0, len(indices), READ_AT_ONCE):
                rows = indices[first : first + READ_AT_ONCE]
                try:
                    whole = self._rows(rows)[1].tolist()
                except (RuntimeError, ValueError):
                    whole = [self._is_whole(row) for row in rows]
                damaged += [row for row, is_whole in zip(rows, whole, strict=True) if not is_whole]
            if len(damaged) > max(FEW, len(indices) // 2):
                raise ValueError(f"{len(damaged)} of {len(indices)} trajectories cannot be read")
        return damaged

    def remove_damaged_flags(self) -> None:
        """Remove the flags that cannot be read: their trajectories count as missing."""
        with self._damage_reported():
            flags = self._array("done")
            there = sorted(self._written_flags(flags))
            with contextlib.suppress(RuntimeError, ValueError):
                _read_rows(flags, there)
                return
            for index in there:
                try:
                    flags[index]
                except (RuntimeError, ValueError):
                    place = flags.metadata.encode_chunk_key((index,))
                    (self.path / flags.path / place).unlink()

    def _array(self, name: str) -> Any:
        return self.group[f"{self.name}/{name}"]

    def _opened_to_write(self) -> Any:
        return zarr.open_group(self.path, mode="r+")[self.name]

    def _names(self) -> tuple[str, ...]:
        """Return the names of the arrays of trajectories."""
        has_parameters = f"{self.name}/parameters" in self.group
        return ("inputs", "outputs", "kinds", *(["parameters"] if has_parameters else []))

    def _written_flags(self, flags: Any) -> set[int]:
        """Return the indices of all flags that were ever written, set or not."""
        place = self.path / flags.path / flags.metadata.encode_chunk_key((0,))
        if not place.parent.is_dir():
            return set()
        return {int(name) for name in os.listdir(place.parent) if name.isdigit()}

    def _rows(self, rows: Sequence[int]) -> tuple[dict[str, NDArray[Any]], NDArray[np.bool_]]:
        """Read trajectories, as arrays by name, and tell which are whole, shape (n,).

        A chunk whose file is lost is read as the fill value NaN.
        """
        found = {name: _read_rows(self._array(name), rows) for name in self._names()}
        whole = np.ones(len(rows), dtype=bool)
        for name in found.keys() - {"kinds"}:
            enough = np.any if self.lacks_outputs and name == "outputs" else np.all
            whole &= enough(np.isfinite(found[name]), axis=tuple(range(1, found[name].ndim)))
        return found, whole

    def _is_whole(self, row: int) -> bool:
        try:
            return bool(self._rows([row])[1].all())
        except (RuntimeError, ValueError):
            return False

    @contextlib.contextmanager
    def _damage_reported(self) -> Iterator[None]:
        """Turn exceptions of Zarr for damaged files into a StoreError with the remedy."""
        try:
            yield
        except (RuntimeError, ValueError, KeyError, TypeError) as error:
            raise StoreError(
                f"{self.path}: a file of split {self.name!r} is damaged or missing ({error}); "
                "generate again (slide-fmu generate RECIPE makes a damaged trajectory alone "
                "again, and with --overwrite all of them)"
            ) from error


def create_split(group: Any, count: int, shapes: Shapes) -> None:
    """Create the arrays of a split, filled with NaN, and without flags.

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


def _read_rows(array: Any, rows: Sequence[int]) -> NDArray[Any]:
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
