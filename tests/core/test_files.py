"""Files that are written as a whole, and archives that are the same every time."""

from __future__ import annotations

import errno
import pickle
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from slide_fmu.core.files import FullDiskError, write_whole, write_zip
from slide_fmu.core.search_path import AmbiguousFileError, find_file, make_importable
from tests.limits import HANGS, largest_file
from tests.refusals import refused


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_whole(path, b"old")
    with largest_file(1000), pytest.raises(OSError, match="File too large") as caught:
        write_whole(path, bytes(5000))
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(
    not Path("/proc/self").exists(), reason="needs /proc, where nothing is written"
)
def test_a_place_that_cannot_be_written_to_is_named() -> None:
    path = Path("/proc/a.bin")
    with pytest.raises(OSError, match="/proc/a") as caught:
        write_whole(path, b"new")
    assert caught.value.filename == str(path)


WRITER = """
import sys, time
from pathlib import Path
from slide_fmu.core.files import write_whole
write_whole(Path(sys.argv[1]), bytes(500_000_000))
time.sleep(60)
"""


@pytest.mark.extended
def test_nothing_is_left_where_a_program_is_ended(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_whole(path, b"old")
    with subprocess.Popen([sys.executable, "-c", WRITER, str(path)]) as program:
        while len(list(tmp_path.iterdir())) < 2 and program.poll() is None:
            time.sleep(1e-4)
        program.terminate()
        assert program.wait(HANGS) == -signal.SIGTERM
    assert list(tmp_path.iterdir()) == [path]


def test_who_asks_for_sigterm_goes_on_getting_it(tmp_path: Path) -> None:
    def asked(number: int, frame: object) -> None:
        """Of the program that writes."""

    before = signal.signal(signal.SIGTERM, asked)
    try:
        write_whole(tmp_path / "a.bin", b"new")
        assert signal.getsignal(signal.SIGTERM) is asked
    finally:
        signal.signal(signal.SIGTERM, before)


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


def test_full_disk_is_named_with_the_file_its_folder_and_the_free_space(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.bin"
    write_whole(path, b"old")

    def fill(staged: Path, content: bytes) -> None:
        with staged.open("wb") as file:
            file.write(content[:2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fill)
    with pytest.raises(FullDiskError) as caught:
        write_whole(path, b"newer")
    said = str(caught.value)
    assert repr(str(path)) in said
    assert f"MB are free in {str(tmp_path)!r}; make room there" in said
    assert caught.value.errno == errno.ENOSPC
    assert str(pickle.loads(pickle.dumps(caught.value))).startswith(said.split(",")[0])
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_full_disk_in_a_folder_that_is_not_there_is_named_too(tmp_path: Path) -> None:
    error = FullDiskError(errno.ENOSPC, "No space left on device", str(tmp_path / "b" / "c.bin"))
    assert f"free in {str(tmp_path)!r}" in str(error)


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """Two folders of recipes and the current one, each with its own record."""
    found = {name: tmp_path / name for name in ("here", "first", "second")}
    for name, folder in found.items():
        folder.mkdir()
        (folder / "bench.csv").write_text(name)
    monkeypatch.chdir(found["here"])
    monkeypatch.setattr(sys, "path", list(sys.path))
    return found


def test_file_of_the_recipe_that_is_used_is_found(folders: dict[str, Path]) -> None:
    """Not that of a recipe which this process used before."""
    (folders["here"] / "bench.csv").unlink()
    for name in ("first", "second", "first"):
        make_importable(folders[name])
        assert find_file("bench.csv") == folders[name] / "bench.csv"


def test_file_here_that_is_another_than_the_recipes_is_refused(folders: dict[str, Path]) -> None:
    make_importable(folders["first"])
    with refused(AmbiguousFileError, "two files 'bench.csv' that differ", "first"):
        find_file("bench.csv")
    (folders["here"] / "bench.csv").write_text("first")
    assert find_file("bench.csv").read_text() == "first"
    make_importable()
    assert find_file("bench.csv") == folders["here"] / "bench.csv"
