"""Files are written whole or not at all, and zip archives are the same every time."""

from __future__ import annotations

import errno
import io
import shutil
import signal
import threading
import uuid
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

OLDEST = (1980, 1, 1, 0, 0, 0)
"""Time stamp of all members: the earliest that zip archives can hold."""


FULL = errno.ENOSPC, errno.EDQUOT
"""Error numbers of a full disk, or of a user's full share of it."""


class FullDiskError(OSError):
    """The disk is full; the message has the file, its folder and the free space.

    It is made of error number, text and path only, so that it can be passed between processes.
    """

    def __str__(self) -> str:
        folder = Path(self.filename).absolute().parent
        while not folder.exists():
            folder = folder.parent
        free = shutil.disk_usage(folder).free
        return (
            f"{self.filename!r} cannot be written: the disk is full, {free / 1e6:.3g} MB are free "
            f"in {str(folder)!r}; make room there, or choose another folder, and try again"
        )


REASONS = {
    errno.ENOENT: "there is no such file or folder",
    errno.EISDIR: "is a folder; expected a file",
    errno.ENOTDIR: "a part of the path is a file; expected folders",
    errno.EACCES: "may not be read or written by this user",
    errno.EPERM: "may not be read or written by this user",
    errno.EEXIST: "a part of the path is a file; expected folders",  # where folders are made
    errno.EROFS: "cannot be written; the disk is for reading only",
}
"""Reasons why a path cannot be used, by the error number of the operating system."""


def reason_of(error: OSError) -> str:
    """Return a message that names the path and the reason why the operating system refused it.

    Messages that were already written for users stay as they are.
    """
    if not str(error).startswith("[Errno") or error.filename is None:
        return str(error)
    reason = REASONS.get(error.errno or 0, error.strerror or "cannot be used")
    return f"{str(error.filename)!r}: {reason}: check the path"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file next to its place, then rename it: if anything fails, the old file stays.

    Its folder is made if it does not exist.

    Raises:
        FullDiskError: the disk is full.
        OSError: the file cannot be written; it names the path.
    """
    staged = path.with_name(f".{path.name}.{uuid.uuid4().hex[:12]}")  # several may write at once
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with _removed_at_the_end(staged):
            staged.write_bytes(content)
            staged.replace(path)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Name the file or folder that the block writes, if that fails.

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
    """Name the file or folder that the block fills, if the disk is full.

    Raises:
        FullDiskError: the disk is full.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise FullDiskError(error.errno, error.strerror, str(path)) from error


@contextmanager
def _removed_at_the_end(staged: Path) -> Iterator[None]:
    """Remove the staged file at the end, also if SIGTERM ends the program."""

    def remove() -> None:
        with suppress(OSError):  # a disk that refuses writing may refuse removing too
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
    """Write a zip archive with ``write_whole``; the same members give the same bytes.

    The members are file contents by name; names use ``/``.
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
