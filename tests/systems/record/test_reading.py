"""Records from files: what was written comes back, and malformed files are refused."""

from __future__ import annotations

import hashlib
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from slide_fmu.systems.record.measured import Record, RecordError
from slide_fmu.systems.record.reading import read_record, read_records
from slide_fmu.systems.record.table import library

RNG = np.random.default_rng(0)
TIME = 0.001 * np.arange(200)
ROAD, TRAVEL = RNG.normal(size=200), RNG.normal(size=200)


def as_csv(path: Path, text: str | None = None) -> None:
    rows = [f"{t!r},{r!r},{y!r}" for t, r, y in zip(*map(np.ndarray.tolist, data()), strict=True)]
    path.write_text(text or "\n".join(["time [s],road [mm],travel (mm)", *rows]), encoding="utf-8")


def data() -> tuple[np.ndarray, ...]:
    return TIME, ROAD, TRAVEL


def as_parquet(path: Path) -> None:
    pq.write_table(
        pa.table(dict(zip(("time", "road [mm]", "travel [mm]"), data(), strict=True))), path
    )


def as_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, values in zip(("time", "road", "travel"), data(), strict=True):
            file[name] = values
            file[name].attrs["unit"] = "s" if name == "time" else "mm"


def as_mat(path: Path) -> None:
    savemat(path, {"time": TIME[:, None], "road": ROAD, "travel": TRAVEL[None, :], "fs": 1000.0})


def as_new_mat(path: Path) -> None:
    """As MATLAB writes version 7.3: HDF5 behind 512 bytes, arrays with their axes reversed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in zip(("time", "road", "travel"), data(), strict=True):
            file[name] = values[None, :]


FORMATS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "csv": ("a.csv", as_csv),
    "parquet": ("a.parquet", as_parquet),
    "hdf5": ("a.h5", as_hdf5),
    "mat": ("a.mat", as_mat),
    "mat 7.3": ("a.mat", as_new_mat),
}


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
    with pytest.raises(RecordError, match=r"no columns \['force'\].*'road', .*'travel'"):
        read_record(str(tmp_path / name), ["road", "force"])


@pytest.mark.parametrize("form", FORMATS)
def test_record_that_is_too_large_is_refused_with_its_size(tmp_path: Path, form: str) -> None:
    name, write = FORMATS[form]
    write(tmp_path / name)
    with pytest.raises(
        RecordError, match=r"200 samples of 3 columns.*at most 199 samples.*name only"
    ):
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
    with pytest.raises(RecordError, match=r"a\.mat.*that is whole"):
        read_record(str(path))


@pytest.mark.parametrize("form", FORMATS)
def test_empty_file_is_refused(tmp_path: Path, form: str) -> None:
    name = FORMATS[form][0]
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(RecordError, match=name):
        read_record(str(tmp_path / name))


def test_points_that_group_thousands_are_texts_beside_decimal_commas(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t;u\n0,0;1,5\n0,1;1.234\n0,2;1.234,5\n")
    record = read_record(str(tmp_path / "a.csv"))
    (text,) = record.texts
    assert (text.count, text.sample, text.value) == (2, 1, "1.234")
    assert record.columns["u"] == pytest.approx([1.5, np.nan, np.nan], nan_ok=True)


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "|"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("units", ["brackets", "parentheses", "second line", "none"])
def test_csv_is_read_however_it_is_written(
    tmp_path: Path, separator: str, decimal: str, units: str
) -> None:
    if separator == decimal:
        return
    ends = {"brackets": " [{}]", "parentheses": " ({})"}.get(units, "")
    header = separator.join(
        n + ends.format(u) for n, u in (("t", "ms"), ("road", "m"), ("y", "°C"))
    )
    second = [separator.join(("ms", "m", "°C"))] if units == "second line" else []
    rows = [
        separator.join(f"{v:.4f}" for v in row).replace(".", decimal)
        for row in zip(1000 * TIME, ROAD, TRAVEL, strict=True)
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *second, *rows]) + "\n", encoding="utf-8")
    record = read_record(str(path))
    scale = 1.0 if units == "none" else 1e-3
    assert record.time == pytest.approx(scale * 1000 * TIME, abs=1e-9)
    assert record.columns["road"] == pytest.approx(ROAD, abs=5.1e-5)
    assert record.columns["y"] == pytest.approx(TRAVEL, abs=5.1e-5)
    told = {"road": "", "y": ""} if units == "none" else {"road": "m", "y": "°C"}
    assert record.units == told
    assert record.place(0).startswith("sample 0 (line 3" if second else "sample 0 (line 2")


@given(
    st.lists(
        st.tuples(*[st.floats(allow_nan=False, allow_infinity=False, width=64)] * 2),
        min_size=2,
        max_size=20,
    )
)
def test_all_numbers_come_back_from_csv_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, float]]
) -> None:
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    path.write_text("u,y\n" + "\n".join(f"{u!r},{y!r}" for u, y in rows), encoding="utf-8")
    record = read_record(str(path), step=0.1)
    assert np.array_equal(record.chosen(("u", "y")), np.array(rows))


def test_unit_behind_a_name_counts_more_than_that_of_the_second_line(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u [N],y\ns,x,[mm]\n0,1,2\n1,2,3\n")
    assert read_record(str(tmp_path / "a.csv")).units == {"u": "N", "y": "mm"}


def test_windows_code_page_gives_the_unit_its_degree(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes("t;T [°C]\n0;1\n1;2\n".encode("cp1252"))
    assert read_record(str(tmp_path / "a.csv")).units == {"T": "°C"}


def test_text_in_a_later_chunk_is_found_with_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slide_fmu.systems.record.csv_file.CHUNK", 30)
    rows = [f"{0.1 * k:.1f},{k},{k}" for k in range(100)]
    rows[57] = "5.7,fault,57"
    rows[80] = "8.0,over,80"
    as_csv(tmp_path / "a.csv", "\n".join(["t,u,y", *rows]))
    record = read_record(str(tmp_path / "a.csv"))
    (text,) = record.texts
    assert (text.column, text.count, text.sample, text.value) == ("u", 2, 57, "fault")
    assert record.place(text.sample).startswith("sample 57 (line 59, t = 5.7 s)")
    assert np.flatnonzero(np.isnan(record.columns["u"])).tolist() == [57, 80]
    assert np.array_equal(
        np.delete(record.columns["u"], [57, 80]), np.delete(np.arange(100.0), [57, 80])
    )


def test_text_in_a_column_that_is_not_wanted_does_not_matter(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u,comment\n0,1,ok\n1,2,stopped\n")
    assert read_record(str(tmp_path / "a.csv"), ["u"]).texts == ()


def test_empty_lines_at_the_end_are_no_samples_and_those_between_are(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u\n0,1\n\n2,3\n\n\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.columns["u"] == pytest.approx([1, np.nan, 3], nan_ok=True)


def test_lines_that_end_with_a_separator_have_no_further_column(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u,\n0,1,\n1,2,\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert {n: v.tolist() for n, v in record.columns.items()} == {"u": [1, 2]}
    as_csv(tmp_path / "a.csv", "t,u\n0,1,\n1,2,\n")
    assert read_record(str(tmp_path / "a.csv")).columns["u"].tolist() == [1, 2]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,1\n1,2\n2,3\n", "expected the names of the columns: a header is required"),
        ("t,u\n0,1\n1,2,3\n", "expected 2 values in each line"),
        ("t,u\n0,1,2\n1,2\n2,3\n", "expected 2 values in each line"),
        ("t,u,u\n0,1,2\n1,2,3\n", "twice the name 'u'"),
        ("t,,u\n0,1,2\n1,2,3\n", "no name for column 2"),
        ("t,u\n0,1\n", "1 samples.*expected at least two samples"),
        ("t\n0\n1\n", "at least one column beside the time"),
        ("u,y\n0,1\n1,2\n", r"no column of times among \['u', 'y'\].*give the step"),
        ("t [kg],u\n0,1\n1,2\n", "no column of times"),
        ("t,u", "1 lines.*expected a header"),
        ("\x00" * 100, "1 lines.*is it a text file"),
    ],
)
def test_malformed_csv_is_refused_with_its_reason(tmp_path: Path, text: str, message: str) -> None:
    as_csv(tmp_path / "a.csv", text)
    with pytest.raises(RecordError, match=message):
        read_record(str(tmp_path / "a.csv"))


def test_large_csv_is_refused_within_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with path.open("w", encoding="utf-8") as file:
        file.write("t,u,y\n")
        for k in range(50):
            file.write("".join(f"{k}.{i:06d},1.5,2.5\n" for i in range(40_000)))
    read_record(str(tmp_path / "a.csv"), ["u"], most=10**8)  # what is loaded once does not count
    tracemalloc.start()
    with pytest.raises(RecordError, match=r"at least \d+ samples of 3 columns"):
        read_record(str(path), most=200_000)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 0.5 * path.stat().st_size + 40e6


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
    with pytest.raises(RecordError, match="or a time column alone"):
        read_record(str(tmp_path / "a.csv"), time="time", step=0.1)
    with pytest.raises(RecordError, match="positive, finite step"):
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
    with pytest.raises(
        RecordError, match="200 samples of 2 columns to read; expected at most 199"
    ):
        read_record(str(tmp_path / "a.mat"), ["x_2"], step=0.1, most=399)


def test_one_column_of_a_wide_hdf5_array_needs_no_more_memory(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.arange(2_000_000.0).reshape(20_000, 100)
    tracemalloc.start()
    record = read_record(str(tmp_path / "a.h5"), ["x_7"], step=0.1)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.array_equal(record.columns["x_7"], 6 + 100.0 * np.arange(20_000))
    assert most < 2e6  # of 16 MB


def test_csv_of_two_bytes_for_each_character_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t\tu [°C]\n0\t1\n1\t2\n", encoding="utf-16")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.units == {"u": "°C"}
    assert record.columns["u"].tolist() == [1, 2]


def test_mat_structure_gives_its_fields(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"data": {"t": TIME, "road": ROAD, "who": "me"}})
    record = read_record(str(tmp_path / "a.mat"))
    assert record.clock == "data.t"
    assert np.array_equal(record.columns["data.road"], ROAD)


def test_wanted_arrays_of_several_lengths_are_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": TIME, "u": ROAD, "y": TRAVEL[:50]})
    with pytest.raises(RecordError, match=r"lengths \{'u': 200, 'y': 50\}"):
        read_record(str(tmp_path / "a.mat"), ["u", "y"])
    assert list(read_record(str(tmp_path / "a.mat")).columns) == ["u"]


def test_many_records_of_unequal_length_have_the_same_columns(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u [N]\n0,1\n1,2\n2,3\n")
    as_csv(tmp_path / "b.csv", "t,u [N]\n0,1\n1,2\n")
    as_csv(tmp_path / "c.csv", "t,u [kN]\n0,1\n1,2\n")
    paths = [str(tmp_path / f"{name}.csv") for name in "abc"]
    assert [len(record.time) for record in read_records(paths[:2])] == [3, 2]
    with pytest.raises(RecordError, match=r"c.csv and .*a.csv differ.*'kN'"):
        read_records(paths)
    with pytest.raises(RecordError, match=r"b.csv has at least 2 samples"):
        read_records(paths[:2], most=9)
    with pytest.raises(RecordError, match="at least one"):
        read_records([])


def test_unknown_ending_and_missing_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.xlsx").write_bytes(b"x")
    with pytest.raises(RecordError, match=r"ends with '.xlsx'.*\.csv"):
        read_record(str(tmp_path / "a.xlsx"))
    with pytest.raises(RecordError, match="no file"):
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
    with pytest.raises(RecordError, match="the same length for all"):
        Record(np.zeros(3), {"u": np.zeros(2)}, {"u": ""}, "a.csv", "")
