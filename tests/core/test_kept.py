"""Files that a run keeps, and what is said where they are damaged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from slide_fmu.core.kept import DamagedFileError, read_kept

WHOLE = json.dumps({"a": 1, "b": [2.5], "more": None}).encode()


def test_kept_object_is_read_with_all_its_keys(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_bytes(WHOLE)
    assert read_kept(tmp_path / "x.json", ("a", "b")) == {"a": 1, "b": [2.5], "more": None}


@pytest.mark.parametrize(
    "damaged",
    [b"", WHOLE[: len(WHOLE) // 2], bytes(range(256)), b"[1]", b"7", b"{}", b'{"a": 1}'],
    ids=["empty", "half", "binary", "list", "number", "no key", "one key"],
)
def test_damaged_file_is_named_with_what_was_expected_and_the_remedy(
    tmp_path: Path, damaged: bytes
) -> None:
    (tmp_path / "x.json").write_bytes(damaged)
    with pytest.raises(
        DamagedFileError, match=r"x\.json is damaged \(.*expected .* keys a, b: do this"
    ):
        read_kept(tmp_path / "x.json", ("a", "b"), "do this")


def test_file_that_cannot_be_read_is_not_called_damaged(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        read_kept(tmp_path, ("a",))
