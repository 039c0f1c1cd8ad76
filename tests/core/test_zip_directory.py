"""Archives with very many members are refused before their list is read."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import pytest

from slide_fmu.core import zip_directory
from slide_fmu.core.zip_directory import (
    MOST_BYTES,
    MOST_MEMBERS,
    LargeMemberError,
    ManyMembersError,
    open_archive,
    read_limited,
)
from slide_fmu.fmu.export import read_member
from slide_fmu.importer.errors import FmuError
from tests.refusals import refused


def archive_of(path: Path, count: int) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for index in range(count):
            archive.writestr(f"{index:0200d}", b"")
    return path


def test_usual_archives_are_opened(tmp_path: Path) -> None:
    with open_archive(archive_of(tmp_path / "a.zip", 10)) as archive:
        assert len(archive.namelist()) == 10


def test_many_members_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = archive_of(tmp_path / "a.fmu", 12_000)
    monkeypatch.setattr(zip_directory.zipfile, "ZipFile", None)  # nobody may read the list
    with refused(ManyMembersError, "expected at most"):
        open_archive(path)
    with pytest.raises(FmuError, match=f"expected at most {MOST_BYTES}"):
        read_member(path, "modelDescription.xml")


def test_many_members_with_short_names_are_refused(tmp_path: Path) -> None:
    """Their list is as short as that of fewer members with long names."""
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        for index in range(MOST_MEMBERS + 1):
            archive.writestr(f"{index:x}", b"")
    with refused(ManyMembersError, "expected at most 10000", "10001 members"):
        open_archive(path)
    with refused(FmuError, "it has 10001 members"):
        read_member(path, "modelDescription.xml")


def test_zip64_archives_tell_their_own_size(tmp_path: Path) -> None:
    content = archive_of(tmp_path / "a.zip", 3).read_bytes()
    end = content.rindex(zip_directory.END)
    begin = struct.unpack_from("<L", content, end + 16)[0]
    record = struct.pack("<4sQHHLLQQQQ", b"PK\x06\x06", 44, 45, 45, 0, 0, 3, 3, 10**9, begin)
    locator = struct.pack("<4sLQL", b"PK\x06\x07", 0, end, 1)
    (tmp_path / "large.zip").write_bytes(content[:end] + record + locator + content[end:])
    with refused(ManyMembersError, "1000000000 bytes"):
        open_archive(tmp_path / "large.zip")


def test_what_is_no_archive_is_said_as_before(tmp_path: Path) -> None:
    (tmp_path / "a.zip").write_bytes(b"no archive")
    with pytest.raises(zipfile.BadZipFile):
        open_archive(tmp_path / "a.zip")


@pytest.mark.parametrize("name", ["../outside", "/outside", "C:\\outside", "a/../../outside"])
def test_member_that_leaves_the_folder_is_refused_unless_asked_for(
    tmp_path: Path, name: str
) -> None:
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(name, b"")
    with refused(zipfile.BadZipFile, "leaves the folder", "do not unpack it"):
        open_archive(path)
    with open_archive(path, outside=True) as archive:
        assert len(archive.namelist()) == 1


def test_member_is_read_up_to_a_limit(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", b" " * 100)
    with open_archive(path) as archive:
        assert len(read_limited(archive, "a", 100)) == 100
        with refused(LargeMemberError, "a has 100 bytes", "at most 99"):
            read_limited(archive, "a", 99)
