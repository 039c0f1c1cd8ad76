"""Files that are never seen half written, and zip archives that are the same every time."""

from __future__ import annotations

import errno
import io
import os
import shutil
import signal
import threading
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

OLDEST = (1980, 1, 1, 0, 0, 0)
"""Time of all members: the earliest that zip archives know."""


FULL = errno.ENOSPC, errno.EDQUOT
"""What systems answer where a disk, or a user's share of it, is full."""


class FullDiskError(OSError):
    """A file cannot be written for want of space; the message names it, its folder and the rest.

    It is made of the error's number, its words and the path, so that it crosses processes.
    """

    def __str__(self) -> str:
        folder = Path(self.filename).absolute().parent
        while not folder.exists():
            folder = folder.parent
        free = shutil.disk_usage(folder).free
        return (
            f"{self.filename!r} cannot be written: the disk is full, {free / 1e6:.3g} MB are free "
            f"in {str(folder)!r}; make room there, or choose another folder, and do the same again"
        )


SAID = {
    errno.ENOENT: "there is no such file or folder",
    errno.EISDIR: "is a folder; expected a file",
    errno.ENOTDIR: "a part of the path is a file; expected folders",
    errno.EACCES: "may not be read or written by this user",
    errno.EPERM: "may not be read or written by this user",
    errno.EEXIST: "a part of the path is a file; expected folders",  # where folders are made
    errno.EROFS: "cannot be written; the disk is for reading only",
}
"""What is said of a path, by what the operating system answers."""


def told_of_system(error: OSError) -> str:
    """Say in words what the operating system refused, and of which path.

    Messages that were written for people stay as they are.
    """
    if not str(error).startswith("[Errno") or error.filename is None:
        return str(error)
    said = SAID.get(error.errno or 0, error.strerror or "cannot be used")
    return f"{str(error.filename)!r}: {said}: check the path"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place, then rename it: whatever fails, the old one stays.

    Its folder is made when it is not there.

    Raises:
        FullDiskError: the disk is full.
        OSError: the file cannot be written; it names the path.
    """
    staged = path.with_name(f".{path.name}.{os.getpid()}")
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with _removed_at_the_end(staged):
            staged.write_bytes(content)
            staged.replace(path)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Name the file or folder that is written in the block, where that fails.

    Raises:
        FullDiskError: the disk is full.
        OSError: it cannot be written for another reason.
    """
    try:
        with filling(path):
            yield
    except FullDiskError:
        raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


@contextmanager
def filling(path: Path) -> Iterator[None]:
    """Name the file or folder that is filled in the block where the disk is full.

    Raises:
        FullDiskError: it is.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise FullDiskError(error.errno, error.strerror, str(path)) from error


@contextmanager
def _removed_at_the_end(staged: Path) -> Iterator[None]:
    """Leave no staged file behind, also where SIGTERM ends the program, which it does as ever."""

    def remove() -> None:
        with suppress(OSError):  # where nothing can be written, nothing can be removed either
            staged.unlink()

    def end(number: int, frame: object) -> None:
        remove()
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)

    in_main_thread = threading.current_thread() is threading.main_thread()
    ours = in_main_thread and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    if ours:
        signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        remove()
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def write_zip(path: Path, members: Mapping[str, bytes]) -> None:
    """Write a zip archive by ``write_whole``; the same members give the same bytes.

    The members are the content of the files in it, by their names with ``/``.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(members):
            info = zipfile.ZipInfo(name, date_time=OLDEST)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3  # Unix, whatever machine writes
            info.external_attr = 0o644 << 16
            archive.writestr(info, members[name])
    write_whole(path, packed.getvalue())
