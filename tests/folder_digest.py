"""Whether two folders of trajectories hold the same, to the byte."""

from __future__ import annotations

import hashlib
from pathlib import Path


def folder_digest(folder: Path) -> str:
    """Return the hash of all files of a folder and of their places.

    What a process that was killed had begun to write is in hidden files, and counts for nothing.
    """
    digest = hashlib.sha256()
    for file in sorted(place for place in folder.rglob("[!.]*") if place.is_file()):
        digest.update(f"{file.relative_to(folder)}\n".encode() + file.read_bytes())
    return digest.hexdigest()
