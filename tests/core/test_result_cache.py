"""Results that are kept under the key of what decides them, and what is said of damaged ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.result_cache import DamagedFileError, ResultFile, key_of
from tests.refusals import refused


@dataclass(frozen=True)
class Figures:
    """Figures of a test."""

    name: str
    errors: tuple[float, ...]


FIGURES = Figures("fir", (0.1, 96.0))


@pytest.mark.parametrize(
    "decides",
    [
        ({"n_in": 96}, "lag"),
        ({"n_in": 97}, "lagg"),
        ({"n_in": 97}, np.array([1.0])),
        ({"n_in": 97}, np.array([1])),
        ({"n_in": 97}, np.array([[1.0]])),
        ({"n_in": 97}, b"\x01"),
        ({"n_in": 97}, FIGURES),
        ({"n_in": 97},),
    ],
    ids=str,
)
def test_key_is_another_where_anything_that_decides_is(decides: tuple[object, ...]) -> None:
    assert key_of(*decides) == key_of(*decides)
    assert key_of(*decides) != key_of({"n_in": 97}, "lag")


def test_key_does_not_depend_on_the_order_of_a_table() -> None:
    assert key_of({"a": 1, "b": (2.5, np.float64(3))}) == key_of(
        {"b": [2.5, 3.0], "a": np.int64(1)}
    )


def test_key_of_an_object_without_a_value_is_refused() -> None:
    with refused(TypeError, "a object in the key of a result"):
        key_of(object())


def test_result_is_found_by_what_decides_it(tmp_path: Path) -> None:
    file = ResultFile.of(tmp_path / "cache", "figures", {"n_in": 96})
    assert file.read_json(Figures) is None
    file.write_json(FIGURES)
    assert ResultFile.of(tmp_path / "cache", "figures", {"n_in": 96}).read_json(Figures) == FIGURES
    assert ResultFile.of(tmp_path / "cache", "figures", {"n_in": 97}).read_json(Figures) is None
    assert file.path.name.startswith("figures-")


def test_arrays_and_bytes_are_read_as_written(tmp_path: Path) -> None:
    arrays = ResultFile(tmp_path / "arrays.npz")
    assert arrays.read_arrays() is None
    arrays.write_arrays({"inputs": np.ones((3, 2)), "kind": np.array(4)})
    read = arrays.read_arrays()
    assert read is not None
    assert np.array_equal(read["inputs"], np.ones((3, 2)))
    assert int(read["kind"]) == 4
    state = ResultFile(tmp_path / "state.pt")
    assert state.read() is None
    state.write(b"state")
    assert state.read() == b"state"


READERS: dict[str, Callable[[ResultFile], object]] = {
    "x.json": lambda file: file.read_json(Figures),
    "x.npz": ResultFile.read_arrays,
    "x.pt": ResultFile.read,
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("damage", ["empty", "half", "changed", "binary", "other JSON"])
def test_damaged_file_is_named_with_the_remedy(tmp_path: Path, name: str, damage: str) -> None:
    file = ResultFile(tmp_path / name, "do this")
    file.write_json(FIGURES) if name == "x.json" else file.write_arrays({"a": np.ones(96)})
    whole = file.path.read_bytes()
    changed = whole.replace(b"96", b"97") if name == "x.json" else whole[:-1] + b"\xff"
    damaged = {
        "empty": b"",
        "half": whole[: len(whole) // 2],
        "changed": changed,
        "binary": bytes(range(256)),
        "other JSON": b'{"result": 3}',
    }
    file.path.write_bytes(damaged[damage])
    with refused(DamagedFileError, f"{name} is damaged (", "expected", "do this"):
        READERS[name](file)


def test_result_of_another_kind_is_damaged(tmp_path: Path) -> None:
    file = ResultFile(tmp_path / "x.json")
    file.write_json({"name": "fir"})
    with refused(DamagedFileError, "x.json is damaged", "errors"):
        file.read_json(Figures)


@pytest.mark.parametrize("content", ['{"versions": {}, "sha256": "0"}', "[]", "3"])
def test_file_of_another_version_is_told_from_a_damaged_one(tmp_path: Path, content: str) -> None:
    file = ResultFile(tmp_path / "x.json", "train again")
    file.path.write_text(content)
    with refused(DamagedFileError, "this version of slide-fmu has not written it", "train again"):
        file.read_json(Figures)


def test_file_that_cannot_be_read_is_not_called_damaged(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        ResultFile(tmp_path).read()
