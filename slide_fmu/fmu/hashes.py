"""Every FMU carries a list with the SHA-256 hashes of its other members.

The list has the format of ``sha256sum``: in the folder of an unpacked FMU, ``sha256sum -c`` reads
it, without slide-fmu. It tells damage and single edits. It is no signature: who changes a member
on purpose can change the list too.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping
from pathlib import Path

from slide_fmu.core.zip_directory import open_archive

HASHES = "extra/io.github.slide-fmu.hashes/SHA256SUMS"
"""The folder is named in reverse domain notation, as FMI 3.0 asks for (section 2.5)."""

LINE = re.compile(r"([0-9a-f]{64})  (.+)")
SHOWN = 5
"""A message names so many members."""


def hash_list(members: Mapping[str, bytes]) -> bytes:
    """Return the list for members of an FMU, by their names in it, sorted."""
    lines = [f"{hashlib.sha256(members[name]).hexdigest()}  {name}\n" for name in sorted(members)]
    return "".join(lines).encode("utf-8")


def hash_problems(path: Path, free: Collection[str] = ()) -> list[str]:
    """Compare the members of an FMU with its list.

    Args:
        path: the FMU, whose archive has no problems.
        free: folders whose files users may change, as ``binaries/``.

    Returns:
        The problems, each one sentence with its remedy; one if there is no list.

    Raises:
        zipfile.BadZipFile, OSError: the file is no archive, or cannot be read.
    """
    with open_archive(path) as archive:
        names = {name for name in archive.namelist() if not name.endswith("/")}
        if HASHES not in names:
            return [
                f"{HASHES} is missing, the list of the hashes of all members; expected in every "
                "FMU of this version: export again"
            ]
        listed = dict(
            (match[2], match[1])
            for line in archive.read(HASHES).decode("utf-8", "replace").splitlines()
            if (match := LINE.fullmatch(line)) is not None
        )
        kept = {n for n in (names | listed.keys()) - {HASHES} if not n.startswith(tuple(free))}
        found = {
            name: hashlib.sha256(archive.read(name)).hexdigest() if name in names else None
            for name in sorted(kept)
        }
    changed = [n for n, value in found.items() if value and n in listed and value != listed[n]]
    missing = [name for name, value in found.items() if value is None]
    added = [name for name in found if name not in listed]
    kinds = (("has another content", changed), ("is missing", missing), ("was added", added))
    return [
        f"{_told(which)} {what} since the FMU was written, by the hashes in {HASHES}; get the "
        "file again, or make it anew"
        for what, which in kinds
        if which
    ]


def _told(names: list[str]) -> str:
    more = f" (and {len(names) - SHOWN} more)" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more
