"""A zip archive is opened only if the number of its members and the size of its list are usual."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path, PurePosixPath, PureWindowsPath

MOST_MEMBERS = 10_000
"""An FMU has a few dozen members, one with C sources a few hundred."""

ENTRY, LONGEST_NAME = 46, 200
"""Bytes of an entry without its name; an assumed limit of the length of names."""

MOST_BYTES = MOST_MEMBERS * (ENTRY + LONGEST_NAME)

END, END_SIZE, LONGEST_COMMENT = b"PK\x05\x06", 22, 65_535
END_64, LOCATOR_64, LOCATOR_SIZE = b"PK\x06\x06", b"PK\x06\x07", 20
"""Structures at the end of an archive (APPNOTE 6.3.10, sections 4.3.14 to 4.3.16)."""


class ManyMembersError(zipfile.BadZipFile):
    """An archive has far more members than an FMU; reading the list would take long."""


class LargeMemberError(zipfile.BadZipFile):
    """A member unpacks to far more than what it should be."""


def leaves(name: str) -> bool:
    """Tell whether a member would be unpacked outside of the folder of its archive."""
    posix, windows = PurePosixPath(name), PureWindowsPath(name)
    return bool(posix.is_absolute() or windows.drive or windows.root or ".." in windows.parts)


def read_limited(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """Read a member of at most so many bytes.

    Raises:
        KeyError: there is none of this name.
        LargeMemberError: it is larger; nothing was read.
    """
    require_size(archive, name, most)
    return archive.read(name)


def require_size(archive: zipfile.ZipFile, name: str, most: int) -> None:
    """Refuse a member of more than so many bytes before it is read; errors as above."""
    size = archive.getinfo(name).file_size
    if size > most:
        raise LargeMemberError(f"{name} has {size} bytes; expected at most {most}")


def open_archive(path: Path, outside: bool = False) -> zipfile.ZipFile:
    """Open a zip archive for reading.

    ``outside`` allows members that leave the folder of the archive.

    Raises:
        zipfile.BadZipFile: a member leaves the folder.
        ManyMembersError: the list of its members is very long and was not read; or it has very
            many members with short names.
        zipfile.BadZipFile: the file is not an archive.
        OSError: it cannot be read.
    """
    size = _size_of_list(path)
    if size > MOST_BYTES:
        raise ManyMembersError(
            f"the list of its members has {size} bytes; expected at most {MOST_BYTES}, enough for "
            f"{MOST_MEMBERS} members"
        )
    try:
        archive = zipfile.ZipFile(path)
    except zipfile.BadZipFile as error:
        if zipfile.is_zipfile(path):
            raise
        raise zipfile.BadZipFile("it is no zip archive, as every FMU is") from error
    count = len(archive.filelist)
    if count > MOST_MEMBERS:
        archive.close()
        raise ManyMembersError(f"it has {count} members; expected at most {MOST_MEMBERS}")
    leaving = [name for name in archive.namelist() if leaves(name)]
    if leaving and not outside:
        archive.close()
        raise zipfile.BadZipFile(
            f"member {leaving[0]!r} leaves the folder of the archive; expected names below it: do "
            "not unpack it"
        )
    return archive


def _size_of_list(path: Path) -> int:
    """Return the size of the list of members in bytes; 0 if no structure states it."""
    with path.open("rb") as file:
        length = file.seek(0, 2)
        file.seek(max(0, length - END_SIZE - LONGEST_COMMENT - LOCATOR_SIZE))
        tail = file.read()
        place = tail.rfind(END)
        if place < 0 or len(tail) < place + END_SIZE:
            return 0
        size = int(struct.unpack_from("<L", tail, place + 12)[0])
        locator = tail[max(0, place - LOCATOR_SIZE) : place]
        if locator[:4] != LOCATOR_64:  # otherwise it is a large archive in the Zip64 format
            return size
        file.seek(min(length, struct.unpack_from("<Q", locator, 8)[0]))
        entry = file.read(56)
        if entry[:4] != END_64 or len(entry) < 56:
            return size
        return int(struct.unpack_from("<Q", entry, 40)[0])
