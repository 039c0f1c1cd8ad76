"""Files that are never seen half written, and zip archives that are the same every time."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

OLDEST = (1980, 1, 1, 0, 0, 0)
"""Time of all members: the earliest that zip archives know."""


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place, then rename it: whatever fails, the old one stays.

    Args:
        path: the file; its folder is made when it is not there.
        content: of the file.

    Raises:
        OSError: the file cannot be written; it names the path.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    staged = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        staged.write_bytes(content)
        staged.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        staged.unlink(missing_ok=True)


def write_zip(path: Path, members: Mapping[str, bytes]) -> None:
    """Write a zip archive as a whole; the same members give the same bytes.

    Args:
        path: the file; its folder is made when it is not there.
        members: content of the files in it, by their names with ``/``.

    Raises:
        OSError: the file cannot be written; it names the path.
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
