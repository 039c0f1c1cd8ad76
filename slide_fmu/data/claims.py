"""A process claims a trajectory before it simulates it, so that no other process does the same.

A claim is a file in a folder next to the store, locked by the operating system. It ends with the
process that holds it, also on another machine that shares the disk. So a killed process blocks no
other one, and no claim is ever stale.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from pathlib import Path

import filelock

from slide_fmu.core.files import writing

CANNOT_LOCK = errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP
"""Error numbers of systems where a disk has no locks."""


class ClaimError(OSError):
    """The disk that holds the store cannot lock files, so that processes could not share it."""


@contextlib.contextmanager
def claimed(store: Path, split: str, index: int) -> Iterator[bool]:
    """Claim a trajectory during the block; the value says whether that was possible.

    The holder of a claim checks the store first, since another process may just have finished.

    Raises:
        ClaimError: the disk cannot lock files.
        OSError: the folder of the claims cannot be written; it names the path.
    """
    place = claims_folder(store) / f"{split}_{index}"
    with writing(place.parent):
        place.parent.mkdir(parents=True, exist_ok=True)
    with locked(place) as free:
        yield free


def claims_folder(store: Path) -> Path:
    """Return the folder of the claims of a store; files of killed processes there are unlocked."""
    return store.with_name("claims")


@contextlib.contextmanager
def locked(place: Path, patience: float = 0.0) -> Iterator[bool]:
    """Lock a file during the block; the value says whether it was free within the patience, in s.

    The file is removed before its lock ends; a process that has opened it then locks a new file.

    Raises:
        ClaimError: the disk cannot lock files.
    """
    # without locks, claim files would remain after their process has been killed
    lock = filelock.FileLock(place, timeout=patience, fallback_to_soft=False)
    try:
        lock.acquire()
    except filelock.Timeout:
        yield False
        return
    except OSError as error:
        if error.errno not in CANNOT_LOCK:
            raise
        raise ClaimError(
            f"{str(place.parent)!r} lies on a disk that cannot lock files ({error.strerror}); "
            "expected one that can, since several processes may work there: mount it with locks "
            "(Lustre: -o flock; NFS: not with nolock), or keep the work elsewhere (--runs FOLDER)"
        ) from error
    try:
        yield True
    finally:
        with contextlib.suppress(PermissionError):  # Windows removes no file that is open
            place.unlink(missing_ok=True)
        lock.release()
