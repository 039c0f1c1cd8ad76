"""Files that a run keeps, and what is said where they are damaged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from slide_fmu.core.kept import Memo, read_kept, sealed
from slide_fmu.core.result_cache import DamagedFileError
from tests.refusals import refused

WHOLE = json.dumps(sealed({"a": 1, "b": [2.5], "more": None})).encode()


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
    with refused(DamagedFileError, "x.json is damaged (", "expected", "keys a, b: do this"):
        read_kept(tmp_path / "x.json", ("a", "b"), "do this")


def test_file_that_cannot_be_read_is_not_called_damaged(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        read_kept(tmp_path, ("a",))


def test_digit_that_a_flipped_bit_has_changed_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "kept.json"
    record = {"values": {"n_in": 96}, "pair": (0.1, float("nan"))}
    path.write_text(json.dumps(sealed(record), indent=1))
    assert read_kept(path, ("values",)).keys() == record.keys()
    path.write_text(path.read_text().replace("96", "97"))
    with refused(DamagedFileError, "kept.json is damaged", "does not have the hash"):
        read_kept(path, ("values",))


def test_object_without_a_hash_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "kept.json"
    path.write_text('{"values": 3}')
    with refused(DamagedFileError, "does not have the hash"):
        read_kept(path, ("values",))


def test_memo_gives_what_was_made_from_the_same(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "memo.json"
    memo = Memo(path, {"recipe": {"n_in": 96}, "probe": [0.5]})
    assert memo.found("values") is None
    memo.keep("values", {"a": [1, 2.5]})
    assert memo.found("values") == {"a": [1, 2.5]}
    assert Memo(path, {"recipe": {"n_in": 97}, "probe": [0.5]}).found("values") is None
    nearly = Memo(path, {"recipe": {"n_in": 96}, "probe": [0.6]}, lambda kept, now: True)
    assert nearly.found("values") == {"a": [1, 2.5]}


def test_damaged_memo_is_named(tmp_path: Path) -> None:
    path = tmp_path / "memo.json"
    Memo(path, {"key": "x"}).keep("figures", 96)
    path.write_text(path.read_text().replace("96", "97"))
    with refused(DamagedFileError, "memo.json is damaged", "remove it"):
        Memo(path, {"key": "x"}).found("figures")
    path.write_text('{"figures": 96}')
    with refused(DamagedFileError, "expected", "keys key, figures"):
        Memo(path, {"key": "x"}).found("figures")
