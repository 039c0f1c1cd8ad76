"""A result that took time is kept in a file, named by the key of everything that decides it.

So a result is found again as long as nothing that decides it has changed, and no result of another
recipe, model or version is ever used: it has another key. A file is written whole or not at all,
and holds a hash of its content, so that a damaged one is noticed. Several programs may keep
results in one folder: they may do the same work twice, but never leave half of it.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.figures import plain, read_figures
from slide_fmu.core.files import write_whole

REMOVED = "remove it, and it is made again"
"""The remedy for a file that the same command can make again."""

RESULT, HASH = "result", "sha256"
"""Keys of a JSON file: the result, and the hash of its JSON text with sorted keys."""

SEAL = hashlib.sha256().digest_size
"""Length of the hash at the beginning of any other file, in bytes."""

KEY_DIGITS = 16
"""Hexadecimal digits of a key: two of a million results share one once in 40 million folders."""

Kind = TypeVar("Kind")


class DamagedFileError(ValueError):
    """A file of a run folder does not have the content that was written to it."""


@contextmanager
def damage_named(path: Path, expected: str, remedy: str = REMOVED) -> Iterator[None]:
    """Name the file that the block reads, if it does not have the expected content.

    Args:
        path: the file.
        expected: the expected content, in words.
        remedy: what the user can do.

    Raises:
        DamagedFileError: the block cannot read the file's content.
    """
    try:
        yield
    except (LookupError, TypeError, ValueError, EOFError, BadZipFile) as error:
        why = f"{type(error).__name__}: {error}"
        raise DamagedFileError(
            f"{path} is damaged ({why}); expected {expected}: {remedy}"
        ) from error


def key_of(*decides: object) -> str:
    """Return the key of what decides a result: figures, tables of a recipe, arrays, bytes.

    Values that JSON cannot tell apart, such as tuples and lists, have the same key.

    Raises:
        TypeError: a value is none of these.
    """
    text = json.dumps(plain(decides), sort_keys=True, default=_digest_of)
    return hashlib.sha256(text.encode()).hexdigest()[:KEY_DIGITS]


def _digest_of(value: object) -> object:
    """Return what stands for a value in the text of a key."""
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()
    raise TypeError(f"a {type(value).__name__} in the key of a result; expected values of JSON")


@final
@dataclass(frozen=True)
class ResultFile:
    """A ResultFile keeps one result; reading gives None while there is none.

    Attributes:
        path: its place.
        remedy: what the user can do where the file is damaged.
    """

    path: Path
    remedy: str = REMOVED

    @classmethod
    def of(cls, folder: Path, name: str, *decides: object, suffix: str = ".json") -> ResultFile:
        """Return the file of a result in a folder: a readable name, and the key of ``decides``."""
        return cls(folder / f"{name}-{key_of(*decides)}{suffix}")

    def read(self) -> bytes | None:
        """Return the bytes that were written.

        Raises:
            DamagedFileError: the file has changed since it was written.
            OSError: it cannot be read.
        """
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return None
        with damage_named(self.path, "the bytes that were written", self.remedy):
            if hashlib.sha256(content[SEAL:]).digest() != content[:SEAL]:
                raise ValueError("it does not have the hash with which it was written")
        return content[SEAL:]

    def write(self, content: bytes) -> None:
        """Write bytes; the folder is made if it does not exist.

        Raises:
            FullDiskError: the disk is full.
            OSError: the file cannot be written.
        """
        write_whole(self.path, hashlib.sha256(content).digest() + content)

    def read_arrays(self) -> dict[str, NDArray[Any]] | None:
        """Return the arrays that were written, by name.

        Raises:
            DamagedFileError, OSError: as in ``read``.
        """
        content = self.read()
        if content is None:
            return None
        with (
            damage_named(self.path, "arrays of numpy", self.remedy),
            np.load(io.BytesIO(content)) as arrays,
        ):
            return dict(arrays)

    def write_arrays(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write arrays by name, as numpy packs them (``npz``).

        Raises:
            FullDiskError, OSError: as in ``write``.
        """
        packed = io.BytesIO()
        np.savez(packed, **arrays)  # type: ignore[arg-type]  # no array has a name of an option
        self.write(packed.getvalue())

    def read_json(self, kind: type[Kind]) -> Kind | None:
        """Return the figures, or the values of JSON, that were written; they are of this kind.

        Raises:
            DamagedFileError, OSError: as in ``read``; also where the result is of another kind.
        """
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return None
        with damage_named(self.path, "the JSON text that was written", self.remedy):
            values = json.loads(content.decode("utf-8"))
            if not (isinstance(values, dict) and {RESULT, HASH} <= values.keys()):
                raise ValueError("this version of slide-fmu has not written it")
            if values[HASH] != _hash(values[RESULT]):
                raise ValueError("it does not have the hash with which it was written")
            return read_figures(kind, values[RESULT])

    def write_json(self, result: object) -> None:
        """Write figures, or values that JSON can hold, as a text that people can read.

        Raises:
            FullDiskError, OSError: as in ``write``.
        """
        values = plain(result)
        text = json.dumps({RESULT: values, HASH: _hash(values)}, indent=1)
        write_whole(self.path, (text + "\n").encode("utf-8"))


def _hash(values: object) -> str:
    """Hash values as JSON returns them: JSON turns tuples into lists, and all keys into texts."""
    text = json.dumps(json.loads(json.dumps(values)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
