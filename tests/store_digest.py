"""Whether two stores hold the same, to the byte."""

from __future__ import annotations

import hashlib
from pathlib import Path


def store_digest(store: Path) -> str:
    """Return the hash of all files of a store and of their places.

    What a process that was killed had begun to write is beside the files, and counts for nothing.
    """
    digest = hashlib.sha256()
    for file in sorted(place for place in store.rglob("*") if place.is_file()):
        if file.suffix != ".partial":
            digest.update(f"{file.relative_to(store)}\n".encode() + file.read_bytes())
    return digest.hexdigest()
