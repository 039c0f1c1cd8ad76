"""Result files of a run are read again; an error names a file that is damaged.

A ``Memo`` keeps a result together with what it was made from. So nothing is computed twice, and no
result of another recipe or model is used.
"""

from __future__ import annotations

import hashlib
import json
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slide_fmu.core.files import write_whole
from slide_fmu.core.result_cache import REMOVED, damage_named

DIGEST = "sha256"
"""The key of the hash in a JSON object; the hash is over all other keys."""


def read_kept(path: Path, keys: tuple[str, ...], remedy: str = REMOVED) -> dict[str, Any]:
    """Read a JSON object that has these keys, and a hash written by ``sealed``.

    Raises:
        DamagedFileError: the file has no such object, or has changed since it was written.
        OSError: it cannot be read.
    """
    with damage_named(path, f"a JSON object with the keys {', '.join(keys)}", remedy):
        found = {**json.loads(path.read_bytes().decode("utf-8"))}
        if found.pop(DIGEST, None) != _digest(found):
            raise ValueError("it does not have the hash with which it was written")
        return found | {key: found[key] for key in keys}


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return an object for JSON with its hash, by which ``read_kept`` detects changed bits."""
    return {**content, DIGEST: _digest(content)}


@dataclass(frozen=True)
class Memo:
    """A Memo is a JSON file that keeps a result with what it was made from.

    Attributes:
        path: the file.
        made_from: what the result depends on, as JSON has it.
        same: says whether two values of ``made_from`` are the same.
    """

    path: Path
    made_from: Mapping[str, Any]
    same: Callable[[Any, Any], bool] = operator.eq

    def found(self, name: str) -> Any | None:
        """Return the result of a name; None if no result from the same ``made_from`` is kept.

        Raises:
            DamagedFileError: the file is damaged.
            OSError: it cannot be read.
        """
        if not self.path.exists():
            return None
        content = read_kept(self.path, (*self.made_from, name))
        kept = {key: content[key] for key in self.made_from}
        return content[name] if self.same(kept, self.made_from) else None

    def keep(self, name: str, result: Any) -> None:
        """Write a result, which JSON can hold, under a name.

        Raises:
            OSError: the file cannot be written.
        """
        text = json.dumps(sealed({**self.made_from, name: result}), indent=1)
        write_whole(self.path, (text + "\n").encode("utf-8"))


def _digest(content: Mapping[str, Any]) -> str:
    """Hash an object as JSON returns it: JSON turns tuples into lists."""
    text = json.dumps(json.loads(json.dumps(content)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
