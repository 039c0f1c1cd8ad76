"""Files that are written as a whole, and archives that are the same every time."""

from __future__ import annotations

import time
import zipfile
from pathlib import Path

import pytest
from limits import largest_file

from slide_fmu.archive import write_whole, write_zip


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_whole(path, b"old")
    with largest_file(1000), pytest.raises(OSError, match="File too large") as caught:
        write_whole(path, bytes(5000))
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_stays_a_folder(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    path.mkdir()
    with pytest.raises(IsADirectoryError) as caught:
        write_zip(path, {"a": b"1"})
    assert caught.value.filename == str(path)
    assert list(tmp_path.rglob("*")) == [path]


def test_the_same_members_give_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = tmp_path / "new" / "one.zip", tmp_path / "two.zip"
    write_zip(one, {"b/c": b"1", "a": b"2"})
    monkeypatch.setattr(time, "time", lambda: 2e9)
    write_zip(two, {"a": b"2", "b/c": b"1"})
    assert one.read_bytes() == two.read_bytes()
    with zipfile.ZipFile(two) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == {
            "a": b"2",
            "b/c": b"1",
        }
