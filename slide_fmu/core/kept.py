"""Files in which a run keeps what it found are read again; a damaged one is named."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

REMOVED = "remove it, and it is made again"
"""The remedy for what can be found again by the same command."""


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

    Raises:
        DamagedFileError: the file holds none.
        OSError: it cannot be read.
    """
    with damage_named(path, f"a JSON object with the keys {', '.join(keys)}", remedy):
        found = json.loads(path.read_bytes().decode("utf-8"))
        return {**found, **{key: found[key] for key in keys}}
