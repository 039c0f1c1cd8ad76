"""Files in which a run keeps what it found are read again; a damaged one is named.

A ``Memo`` keeps a result with what it was made from, so that nothing is found twice, and nothing
of another recipe or model is taken.
"""

from __future__ import annotations

import hashlib
import json
import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

from slide_fmu.core.files import write_whole

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
    """Read a JSON object that has these keys, and the hash with which it was ``sealed``.

    Raises:
        DamagedFileError: the file holds none, or has changed since it was written.
        OSError: it cannot be read.
    """
    with damage_named(path, f"a JSON object with the keys {', '.join(keys)}", remedy):
        found = {**json.loads(path.read_bytes().decode("utf-8"))}
        if found.pop(DIGEST, None) != _digest(found):
            raise ValueError("it does not have the hash with which it was written")
        return found | {key: found[key] for key in keys}


def sealed(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return an object for JSON with its hash, by which ``read_kept`` notices a flipped bit."""
    return {**record, DIGEST: _digest(record)}


@dataclass(frozen=True)
class Memo:
    """A memo is a JSON file that keeps a result with what it was made from.

    Attributes:
        path: the file.
        made_from: what the result depends on, as JSON has it.
        same: tells whether what a kept result was made from, and this, are the same.
    """

    path: Path
    made_from: Mapping[str, Any]
    same: Callable[[Any, Any], bool] = operator.eq

    def found(self, name: str) -> Any | None:
        """Return the result of a name; None where none is kept that was made from the same.

        Raises:
            DamagedFileError: the file is damaged.
            OSError: it cannot be read.
        """
        if not self.path.exists():
            return None
        record = read_kept(self.path, (*self.made_from, name))
        kept = {key: record[key] for key in self.made_from}
        return record[name] if self.same(kept, self.made_from) else None

    def keep(self, name: str, result: Any) -> None:
        """Write a result, which JSON can hold, under a name.

        Raises:
            OSError: the file cannot be written.
        """
        text = json.dumps(sealed({**self.made_from, name: result}), indent=1)
        write_whole(self.path, (text + "\n").encode("utf-8"))


def _digest(record: Mapping[str, Any]) -> str:
    """Hash an object as it is once it was written and read: its pairs are lists then."""
    text = json.dumps(json.loads(json.dumps(record)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
