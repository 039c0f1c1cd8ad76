"""A zip archive is opened only if it has as many members as usual, and a list of usual size."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

MOST_MEMBERS = 10_000
"""An FMU has some dozens of members, one with C sources some hundreds."""

ENTRY, LONGEST_NAME = 46, 200
"""Bytes of an entry without its name; names are hardly ever longer than this."""

MOST_BYTES = MOST_MEMBERS * (ENTRY + LONGEST_NAME)

END, END_SIZE, LONGEST_COMMENT = b"PK\x05\x06", 22, 65_535
END_64, LOCATOR_64, LOCATOR_SIZE = b"PK\x06\x06", b"PK\x06\x07", 20
"""Records at the end of an archive (APPNOTE 6.3.10, sections 4.3.14 to 4.3.16)."""


class ManyMembersError(zipfile.BadZipFile):
    """An archive has far more members than an FMU; to go through them would take long."""


def open_archive(path: Path) -> zipfile.ZipFile:
    """Open a zip archive for reading.

    Raises:
        ManyMembersError: the list of its members is very long, and was not read; or there are
            very many with short names.
        zipfile.BadZipFile: the file is no archive.
        OSError: it cannot be read.
    """
    size = _size_of_list(path)
    if size > MOST_BYTES:
        raise ManyMembersError(
            f"the list of its members has {size} bytes; expected at most {MOST_BYTES}, enough for "
            f"{MOST_MEMBERS} members"
        )
    archive = zipfile.ZipFile(path)
    count = len(archive.filelist)
    if count > MOST_MEMBERS:
        archive.close()
        raise ManyMembersError(f"it has {count} members; expected at most {MOST_MEMBERS}")
    return archive


def _size_of_list(path: Path) -> int:
    """Return how many bytes list the members of an archive; 0 where no record tells it."""
    with path.open("rb") as file:
        length = file.seek(0, 2)
        file.seek(max(0, length - END_SIZE - LONGEST_COMMENT - LOCATOR_SIZE))
        tail = file.read()
        place = tail.rfind(END)
        if place < 0 or len(tail) < place + END_SIZE:
            return 0
        size = int(struct.unpack_from("<L", tail, place + 12)[0])
        locator = tail[max(0, place - LOCATOR_SIZE) : place]
        if locator[:4] != LOCATOR_64:  # else the archive is a large one, of the format Zip64
            return size
        file.seek(min(length, struct.unpack_from("<Q", locator, 8)[0]))
        record = file.read(56)
        if record[:4] != END_64 or len(record) < 56:
            return size
        return int(struct.unpack_from("<Q", record, 40)[0])
