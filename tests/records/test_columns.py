"""Columns that a user names are read whatever else is in the files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.record_files.reading import read_records
from slide_fmu.record_files.record import RecordError
from slide_fmu.records.findings import examine
from slide_fmu.records.proposal import RecordOptions, chosen_columns, read_chosen
from tests.refusals import refused

SAMPLES = 300


def columns(*names: str, seed: int = 0) -> dict[str, np.ndarray]:
    """Times and signals of these names, by which some may pass for times too."""
    rng = np.random.default_rng(seed)
    return {"time": 0.01 * np.arange(SAMPLES)} | {n: rng.normal(size=SAMPLES) for n in names}


def as_csv(path: Path, table: dict[str, np.ndarray]) -> str:
    values = np.stack(list(table.values()), axis=1)
    np.savetxt(path, values, "%.9g", ",", header=",".join(table), comments="")
    return str(path)


def options(*paths: str, inputs: tuple[str, ...] = ("F",), **more: Any) -> RecordOptions:
    return RecordOptions(paths, dict.fromkeys(inputs), **more)


@pytest.mark.parametrize(
    ("inputs", "outputs", "found"),
    [
        (("F",), ("T",), ("T",)),
        (("F",), ("x",), ("x",)),
        (("F",), (), ("x", "T")),
        (("T",), ("x",), ("x",)),
        (("T",), (), ("F", "x")),
    ],
)
@pytest.mark.parametrize("time", [None, "time"])
def test_torque_called_t_is_a_signal_and_no_clock(
    tmp_path: Path,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    found: tuple[str, ...],
    time: str | None,
) -> None:
    path = as_csv(tmp_path / "a.csv", columns("F", "x", "T"))
    asked = options(path, inputs=inputs, outputs=outputs, time=time)
    (record,), _ = read_chosen(asked)
    assert chosen_columns(asked, record) == (inputs, found)
    assert (record.clock, record.other_clocks) == ("time", {})


def test_dates_are_the_clock_beside_a_torque_that_comes_first(tmp_path: Path) -> None:
    table = columns("T", "F", "x")
    dates = (1e9 * table.pop("time")).astype("datetime64[ns]")
    pq.write_table(pa.table({**table, "time": dates}), tmp_path / "a.parquet")
    (record,), _ = read_chosen(options(str(tmp_path / "a.parquet"), outputs=("x",)))
    assert (record.clock, list(record.columns)) == ("time", ["F", "x"])


def test_column_that_only_one_file_has_does_not_matter_where_outputs_are_named(
    tmp_path: Path,
) -> None:
    paths = (
        as_csv(tmp_path / "a.csv", columns("F", "x")),
        as_csv(tmp_path / "b.csv", columns("F", "x", "extra")),
    )
    records, _ = read_chosen(options(*paths, outputs=("x",)))
    assert [list(record.columns) for record in records] == [["F", "x"]] * 2
    with refused(RecordError, "extra", "columns that"):
        read_chosen(options(*paths))


def test_two_columns_of_a_wide_file_need_no_room_for_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = as_csv(tmp_path / "a.csv", columns("F", "x", *(f"c{n}" for n in range(50))))
    most = partial(read_records, most=3 * SAMPLES)
    monkeypatch.setattr("slide_fmu.records.proposal.read_records", most)
    (record,), _ = read_chosen(options(path, outputs=("x",)))
    assert list(record.columns) == ["F", "x"]


def test_named_arrays_of_another_length_than_most_are_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in columns("F", "x", "y").items():
            file[f"a/{name}"] = values
        for name, values in columns("F", "x").items():
            file[f"b/{name}"] = values[::2]
    path = str(tmp_path / "a.h5")
    for outputs in (("b/x",), ()):
        asked = options(path, inputs=("b/F",), outputs=outputs, time="b/time")
        (record,), _ = read_chosen(asked)
        assert chosen_columns(asked, record) == (("b/F",), ("b/x",))
    with refused(RecordError, "lengths {'a/F': 300", "'b/x': 150}"):
        read_chosen(options(path, inputs=("a/F",), outputs=("b/x",)))


def test_times_do_not_count_beside_a_given_step_where_none_is_named(tmp_path: Path) -> None:
    table = columns("F", "x")
    table["time"] = np.round(table["time"], 1)  # they repeat
    path = as_csv(tmp_path / "a.csv", table)
    (record,), _ = read_chosen(options(path, step=0.01))
    [message] = [f.message for f in examine((record,)) if f.severity == "refused"]
    assert "--time none --step SECONDS" in message
    (record,), parameters = read_chosen(options(path, step=0.01, time="none"))
    assert record.time == pytest.approx(0.01 * np.arange(SAMPLES))
    assert list(record.columns) == ["F", "x"]
    assert parameters == {"sample_step": 0.01}
    with refused(RecipeError, "--time none without --step"):
        read_chosen(options(path, time="none"))
