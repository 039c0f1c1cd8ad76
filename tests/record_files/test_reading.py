"""Records from files: what was written comes back from every format."""

from __future__ import annotations

import hashlib
import sys
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from slide_fmu.record_files.reading import read_record, read_records
from slide_fmu.record_files.record import Record, RecordError
from slide_fmu.record_files.table import library
from tests.records.files import FORMATS, ROAD, TIME, TRAVEL, as_csv
from tests.refusals import refused


@pytest.mark.parametrize("form", FORMATS)
def test_record_comes_back_from_every_format(tmp_path: Path, form: str) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    record = read_record(str(tmp_path / name))
    assert np.array_equal(record.time, TIME)
    assert list(record.columns) == ["road", "travel"]
    assert np.array_equal(record.columns["road"], ROAD)
    assert np.array_equal(record.columns["travel"], TRAVEL)
    unit = "" if form.startswith("mat") else "mm"
    assert record.units == {"road": unit, "travel": unit}
    assert record.digest == hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
    assert (record.clock, record.other_clocks, record.texts) == ("time", {}, ())


@pytest.mark.parametrize("form", FORMATS)
def test_only_wanted_columns_are_kept(tmp_path: Path, form: str) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    record = read_record(str(tmp_path / name), ["travel"])
    assert list(record.columns) == ["travel"]
    assert np.array_equal(record.columns["travel"], TRAVEL)
    assert np.array_equal(record.time, TIME)


@pytest.mark.parametrize("form", FORMATS)
def test_missing_column_is_named_beside_those_that_are_there(tmp_path: Path, form: str) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    with refused(RecordError, "no columns ['force']", "'road'", "'travel'"):
        read_record(str(tmp_path / name), ["road", "force"])


@pytest.mark.parametrize("form", FORMATS)
def test_record_that_is_too_large_is_refused_with_its_size(tmp_path: Path, form: str) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    with refused(RecordError, "200 samples of 3 columns", "at most 199 samples", "name only"):
        read_record(str(tmp_path / name), most=599)
    assert len(read_record(str(tmp_path / name), most=600).time) == 200


@pytest.mark.parametrize("form", ["parquet", "hdf5", "mat"])
def test_file_of_another_content_is_refused(tmp_path: Path, form: str) -> None:
    path = tmp_path / FORMATS[form][0]
    path.write_bytes(b"what is this, a record?\n" * 100)
    with pytest.raises(RecordError, match=f"{path.name}.*expected an? .* that is whole"):
        read_record(str(path))


@pytest.mark.parametrize("form", ["parquet", "hdf5", "mat"])
@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9])
def test_file_that_was_cut_is_refused(tmp_path: Path, form: str, kept: float) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: int(kept * len(content))])
    with pytest.raises(RecordError, match=name):
        read_record(str(tmp_path / name), ["road", "travel"])


def test_compressed_mat_file_is_read_and_a_broken_one_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"t": TIME, "road": ROAD}, do_compression=True)
    assert np.array_equal(read_record(str(path)).columns["road"], ROAD)
    content = bytearray(path.read_bytes())
    content[-40:-20] = bytes(20)
    path.write_bytes(content)
    with refused(RecordError, "a.mat", "that is whole"):
        read_record(str(path))


@pytest.mark.parametrize("form", FORMATS)
def test_empty_file_is_refused(tmp_path: Path, form: str) -> None:
    name = FORMATS[form][0]
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(RecordError, match=name):
        read_record(str(tmp_path / name))


def test_time_is_found_by_its_german_name_and_its_unit_in_the_name(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "road;Zeit_ms\n1;0\n2;5\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.clock == "Zeit_ms"
    assert record.time == pytest.approx([0, 0.005])


def test_given_step_makes_the_times_and_leaves_those_of_the_file(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "time,u\n0,1\n5,2\n5,3\n")
    record = read_record(str(tmp_path / "a.csv"), step=0.5)
    assert record.time.tolist() == [0, 0.5, 1.0]
    assert (record.clock, list(record.columns)) == (None, ["u"])


def test_second_clock_is_kept_beside_the_named_one(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "can_time,time [ms],u\n0,0,1\n1,1001,2\n2,2002,3\n")
    record = read_record(str(tmp_path / "a.csv"), time="time")
    assert record.time == pytest.approx([0, 1.001, 2.002])
    assert record.clock_is_chosen
    assert record.other_clocks["can_time"].tolist() == [0, 1, 2]
    found = read_record(str(tmp_path / "a.csv"))
    assert (found.clock, found.clock_is_chosen) == ("can_time", False)


def test_step_and_time_together_are_refused(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv")
    with refused(RecordError, "or a time column alone"):
        read_record(str(tmp_path / "a.csv"), time="time", step=0.1)
    with refused(RecordError, "positive, finite step"):
        read_record(str(tmp_path / "a.csv"), step=0.0)


def test_parquet_dates_become_seconds_and_texts_are_found(tmp_path: Path) -> None:
    stamps = pd.to_datetime(["2024-01-01 12:00:00.0", "2024-01-01 12:00:00.5", None])
    pq.write_table(pa.table({"time": stamps, "u": ["1", "x", "2.5"]}), tmp_path / "a.parquet")
    record = read_record(str(tmp_path / "a.parquet"))
    assert record.time == pytest.approx([0, 0.5, np.nan], nan_ok=True)
    assert record.columns["u"] == pytest.approx([1, np.nan, 2.5], nan_ok=True)
    assert [(t.column, t.sample, t.value) for t in record.texts] == [("u", 1, "x")]


def test_hdf5_groups_and_arrays_of_several_columns_are_named(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/time"] = TIME
        file["run/forces"] = np.stack([ROAD, TRAVEL], axis=1)
        file["run/note"] = "cold"
        file["picture"] = np.zeros((4, 5, 6))
    record = read_record(str(tmp_path / "a.h5"))
    assert list(record.columns) == ["run/forces_1", "run/forces_2"]
    assert np.array_equal(record.columns["run/forces_2"], TRAVEL)


@pytest.mark.parametrize("across", [False, True])
def test_mat_array_of_several_columns_gives_each(tmp_path: Path, across: bool) -> None:
    both = np.stack([ROAD, TRAVEL], axis=0 if across else 1)
    savemat(tmp_path / "a.mat", {"t": TIME, "x": both})
    record = read_record(str(tmp_path / "a.mat"), ["x_2"])
    assert np.array_equal(record.columns["x_2"], TRAVEL)
    with refused(RecordError, "expected at most 199", "200 samples of"):
        read_record(str(tmp_path / "a.mat"), ["x_2"], step=0.1, most=599)


def test_one_column_of_a_wide_hdf5_array_needs_no_more_memory(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.arange(2_000_000.0).reshape(20_000, 100)
    tracemalloc.start()
    record = read_record(str(tmp_path / "a.h5"), ["x_7"], step=0.1)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.array_equal(record.columns["x_7"], 6 + 100.0 * np.arange(20_000))
    assert most < 2e6  # of 16 MB


def test_mat_structure_gives_its_fields(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"data": {"t": TIME, "road": ROAD, "who": "me"}})
    record = read_record(str(tmp_path / "a.mat"))
    assert record.clock == "data.t"
    assert np.array_equal(record.columns["data.road"], ROAD)


def test_wanted_arrays_of_several_lengths_are_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": TIME, "u": ROAD, "y": TRAVEL[:50]})
    with refused(RecordError, "lengths {'u': 200, 'y': 50}"):
        read_record(str(tmp_path / "a.mat"), ["u", "y"])
    assert list(read_record(str(tmp_path / "a.mat")).columns) == ["u"]


def test_many_records_of_unequal_length_have_the_same_columns(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u [N]\n0,1\n1,2\n2,3\n")
    as_csv(tmp_path / "b.csv", "t,u [N]\n0,1\n1,2\n")
    as_csv(tmp_path / "c.csv", "t,u [kN]\n0,1\n1,2\n")
    paths = [str(tmp_path / f"{name}.csv") for name in "abc"]
    assert [len(record.time) for record in read_records(paths[:2])] == [3, 2]
    with refused(RecordError, "c.csv and", "a.csv differ", "'kN'"):
        read_records(paths)
    with refused(RecordError, "2 samples", "b.csv has"):
        read_records(paths[:2], most=9)
    with refused(RecordError, "at least one"):
        read_records([])


def test_the_same_record_twice_is_refused_also_under_another_name(tmp_path: Path) -> None:
    for name in "ab":
        as_csv(tmp_path / f"{name}.csv", "t,u [N]\n0,1\n1,2\n")
    for names in ("aa", "ab"):
        paths = [str(tmp_path / f"{name}.csv") for name in names]
        with refused(RecordError, "holds the same bytes as", "a.csv; expected each"):
            read_records(paths)


def test_unknown_ending_and_missing_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.xlsx").write_bytes(b"x")
    with refused(RecordError, "ends with '.xlsx'", ".csv"):
        read_record(str(tmp_path / "a.xlsx"))
    with refused(RecordError, "no file"):
        read_record(str(tmp_path / "b.csv"))


@pytest.mark.parametrize(("form", "module"), [("csv", "pandas"), ("hdf5", "h5py")])
def test_missing_library_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str, module: str
) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RecordError, match=rf"no package '{module}'.*slide-fmu\[records\]"):
        read_record(str(tmp_path / name))


def test_library_that_is_there_is_imported() -> None:
    assert library("h5py", "a.h5") is h5py


def test_columns_of_unequal_length_make_no_record() -> None:
    with refused(RecordError, "the same length for all"):
        Record(np.zeros(3), {"u": np.zeros(2)}, {"u": ""}, "a.csv", "")


def test_complex_numbers_are_found_like_texts(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["u"], file["y"] = TIME, ROAD, TRAVEL + 1j
    savemat(tmp_path / "a.mat", {"t": TIME, "u": ROAD, "y": TRAVEL + 1j})
    savemat(tmp_path / "b.mat", {"data": {"t": TIME, "u": ROAD, "y": TRAVEL + 1j}})
    for name, column in (("a.h5", "y"), ("a.mat", "y"), ("b.mat", "data.y")):
        record = read_record(str(tmp_path / name))
        assert [(t.column, t.count, t.sample) for t in record.texts] == [(column, 200, 0)]
        assert record.texts[0].value.endswith("1j)")
        assert np.isnan(record.columns[column]).all()


def test_unit_that_is_an_array_of_one_text_is_that_text(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["u"], file["y"] = TIME, ROAD, TRAVEL
        file["u"].attrs["unit"] = np.array(["mm"], dtype=h5py.string_dtype())
        file["y"].attrs["units"] = np.array([b"kN"])
    assert read_record(str(tmp_path / "a.h5")).units == {"u": "mm", "y": "kN"}


def test_mat_structures_within_structures_give_their_fields(tmp_path: Path) -> None:
    content = {"t": TIME, "in": {"road": ROAD}, "out": {"travel": TRAVEL}}
    savemat(tmp_path / "a.mat", {"data": content})
    record = read_record(str(tmp_path / "a.mat"))
    assert list(record.columns) == ["data.in.road", "data.out.travel"]
    assert np.array_equal(record.columns["data.out.travel"], TRAVEL)


def test_unnamed_dates_of_a_parquet_table_are_its_time(tmp_path: Path) -> None:
    table = pd.DataFrame({"u": ROAD, "y": TRAVEL})
    table.index = pd.Timestamp("2024-05-01") + pd.to_timedelta(TIME, unit="s")
    table.to_parquet(tmp_path / "a.parquet")
    for names in (None, ["u", "y"]):
        record = read_record(str(tmp_path / "a.parquet"), names)
        assert record.time == pytest.approx(TIME, abs=1e-9)
        assert list(record.columns) == ["u", "y"]
