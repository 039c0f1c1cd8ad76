"""The files of a store are a Zarr group, with one chunk per trajectory.

Exceptions of Zarr for damaged files become a StoreError here.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import Crc32cCodec, ZstdCodec

from slide_fmu.core.figures import read_figures
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.errors import StoreError
from slide_fmu.data.fingerprint import Fingerprint

FORMAT = 1
"""Stores of other formats are refused. The number rises when the fingerprint gets other keys."""

Shapes = dict[str, tuple[int, ...]]
"""Shapes of a trajectory's ``inputs``, (N, n_inputs), ``outputs``, (N + 1, n_outputs), and, where
there are physical parameters, of these, (n_parameters,)."""


def open_group(path: Path, mode: Any) -> Any:
    """Open the Zarr group of a store in a mode of Zarr."""
    return zarr.open_group(path, mode=mode)


@dataclass(frozen=True, eq=False)
class Attributes:
    """These are the attributes of a store, which describe its origin.

    Attributes:
        fingerprint: values of the recipe.
        probe: outputs of a short motion of the model, or a digest of records
            (``slide_fmu.data.fingerprint.identity``).
    """

    fingerprint: Fingerprint
    probe: FloatArray


def attributes(path: Path) -> Attributes:
    """Return the attributes of a store.

    Raises:
        StoreError: it is not a store, is damaged, or has another version.
    """
    try:
        found = open_group(path, "r").attrs.asdict()
        probe = np.array(found["probe"], dtype=np.float64)
        tables = [found["fingerprint"][name] for name in ("data", "system")]
        if not all(isinstance(table, dict) for table in tables):
            raise TypeError("its recipe has no tables")
    except (FileNotFoundError, LookupError, TypeError, ValueError) as error:
        raise _damaged(path, error) from error
    if found.get("format") != FORMAT:
        raise StoreError(
            f"{path} was made by another version of slide-fmu; generate again (slide-fmu "
            "generate RECIPE --overwrite), or use the version that made it"
        )
    try:
        return Attributes(read_figures(Fingerprint, found["fingerprint"]), probe)
    except ValueError as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> StoreError:
    return StoreError(
        f"{path} is not a trajectory store, or a damaged one ({error}); remove it and "
        "generate again"
    )


def require_store(path: Path) -> None:
    """Raise a StoreError where there is no store."""
    if not path.exists():
        raise StoreError(f"no data at {path}; generate it first (slide-fmu generate RECIPE)")


@contextlib.contextmanager
def damage_reported(path: Path, split: str) -> Iterator[None]:
    """Turn exceptions of Zarr for damaged files into a StoreError with the remedy."""
    try:
        yield
    except (RuntimeError, ValueError, KeyError, TypeError) as error:
        raise StoreError(
            f"{path}: a file of split {split!r} is damaged or missing ({error}); generate again "
            "(slide-fmu generate RECIPE makes a damaged trajectory alone again, and with "
            "--overwrite all of them)"
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


def read_rows(array: Any, rows: Sequence[int]) -> NDArray[Any]:
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
