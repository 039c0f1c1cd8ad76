"""Files in which a run keeps what it found are read again; a damaged one is named."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

REMOVED = "remove it, and it is made again"
"""The remedy for what can be found again by the same command."""

DIGEST = "sha256"
"""The key of the hash of all others in an object of JSON."""


class DamagedFileError(ValueError):
    """A file of a run folder does not hold what was written there."""


@contextmanager
def damage_named(path: Path, expected: str, remedy: str = REMOVED) -> Iterator[None]:
    """Name the file that is read in the block where it does not hold what is expected.

    Args:
        path: the file.
        expected: what it should hold, in words.
        remedy: what is to be done about it.

    Raises:
        DamagedFileError: the block cannot make sense of the file.
    """
    try:
        yield
    except (LookupError, TypeError, ValueError, EOFError, BadZipFile) as error:
        why = f"{type(error).__name__}: {error}"
        raise DamagedFileError(
            f"{path} is damaged ({why}); expected {expected}: {remedy}"
        ) from error


def read_kept(path: Path, keys: tuple[str, ...], remedy: str = REMOVED) -> dict[str, Any]:
    """Read a JSON object that has these keys.

    Its hash (``sealed``) is looked at where it has one: those of former versions have none.

    Raises:
        DamagedFileError: the file holds none, or has changed since it was written.
        OSError: it cannot be read.
    """
    with damage_named(path, f"a JSON object with the keys {', '.join(keys)}", remedy):
        found = {**json.loads(path.read_bytes().decode("utf-8"))}
        stated = found.pop(DIGEST, None)
        if stated is not None and stated != _digest(found):
            raise ValueError("it does not have the hash with which it was written")
        return found | {key: found[key] for key in keys}


def sealed(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return an object for JSON with its hash, by which ``read_kept`` notices a flipped bit."""
    return {**record, DIGEST: _digest(record)}


def _digest(record: Mapping[str, Any]) -> str:
    """Hash an object as it is once it was written and read: its pairs are lists then."""
    text = json.dumps(json.loads(json.dumps(record)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
