"""Times are read however tools write them, or refused with the key that mends it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from slide_fmu.record_files.reading import read_record, read_records
from slide_fmu.record_files.record import NoTimesError
from tests.records.files import ROAD, TIME, as_csv

COUNT = 100
SECONDS = 0.01 * np.arange(COUNT)


def written(path: Path, names: str, rows: list[str], separator: str = ";") -> None:
    lines = [f"{row}{separator}{k}" for k, row in enumerate(rows)]
    as_csv(path, "\n".join([f"{names}{separator}u", *lines]))


def stamps(form: str, start: str = "2024-03-10 23:59:59.5") -> list[str]:
    """Texts of times around a midnight; %f is in ms."""
    dates = pd.Timestamp(start) + pd.to_timedelta(SECONDS, unit="s")
    return [date.strftime(form.replace("%f", f"{date.microsecond // 1000:03d}")) for date in dates]


@pytest.mark.parametrize(
    ("names", "form"),
    [
        ("time", "%d.%m.%Y %H:%M:%S,%f"),
        ("time", "%d/%m/%Y %H:%M:%S.%f"),
        ("time", "%m/%d/%Y %H:%M:%S.%f"),
        ("time", "%d-%m-%Y %H:%M:%S.%f"),
        ("Zeitpunkt der Messung", "%d.%m.%Y %H:%M:%S.%f"),
        ("Datum;Uhrzeit", "%d.%m.%Y;%H:%M:%S.%f"),
        ("date;time", "%Y-%m-%d;%H:%M:%S.%f"),
        ("time", "%H:%M:%S.%f"),
        ("time", "%Y-%m-%dT%H:%M:%S.%fZ"),
        ("time", "%Y/%m/%d %H:%M:%S.%f"),
        ("time", "%d.%m.%y %H:%M:%S,%f"),
        ("time", "%y/%m/%d %H:%M:%S.%f"),
        ("time", "%d-%b-%Y %H:%M:%S.%f"),
        ("time", "%m/%d/%Y %I:%M:%S.%f %p"),
        ("Date;Time", "%m/%d/%y;%I:%M:%S.%f %p"),
        ("time", "%I:%M:%S.%f%p"),
        ("time", "%H:%M:%S:%f"),
    ],
)
@pytest.mark.parametrize("names_of_signals", [None, ["u"]])
def test_dates_and_times_of_day_are_read(
    tmp_path: Path, names: str, form: str, names_of_signals: list[str] | None
) -> None:
    written(tmp_path / "a.csv", names, stamps(form))
    record = read_record(str(tmp_path / "a.csv"), names_of_signals)
    assert record.time - record.time[0] == pytest.approx(SECONDS, abs=1e-6)
    assert (list(record.columns), record.texts, record.clock_unit) == (["u"], (), "s")


def test_blank_between_date_and_time_may_separate_columns(tmp_path: Path) -> None:
    written(tmp_path / "a.txt", "date time", stamps("%Y-%m-%d %H:%M:%S.%f"), " ")
    record = read_record(str(tmp_path / "a.txt"))
    assert record.time - record.time[0] == pytest.approx(SECONDS, abs=1e-6)


def test_order_of_day_and_month_is_the_one_of_the_shorter_record(tmp_path: Path) -> None:
    """At the midnight of 9 and 10 March, the other order would be a jump by a month."""
    for form in ("%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f"):
        written(tmp_path / "a.csv", "time", stamps(form, "2024-03-09 23:59:59.5"))
        record = read_record(str(tmp_path / "a.csv"))
        assert record.time == pytest.approx(SECONDS, abs=1e-6)


def test_hours_of_half_a_day_pass_noon_and_midnight(tmp_path: Path) -> None:
    rows = ["11:59 a.m.", "12:00 p.m.", "1:00 PM", "11:59 pm", "12:00 am", "12:30 AM"]
    written(tmp_path / "a.csv", "time", rows)
    record = read_record(str(tmp_path / "a.csv"))
    assert np.diff(record.time / 60).tolist() == [1, 60, 659, 1, 30]


def test_hours_and_minutes_are_times_of_day(tmp_path: Path) -> None:
    written(tmp_path / "a.csv", "time", ["23:58", "23:59", "0:00", "0:01"])
    record = read_record(str(tmp_path / "a.csv"))
    assert np.diff(record.time).tolist() == [60, 60, 60]


def test_text_among_dates_of_any_kind_is_found(tmp_path: Path) -> None:
    rows = stamps("%d.%m.%Y %H:%M:%S.%f")
    rows[7] = "later"
    written(tmp_path / "a.csv", "time", rows)
    (text,) = read_record(str(tmp_path / "a.csv")).texts
    assert (text.column, text.sample, text.value) == ("time", 7, "later")


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_numbers_since_1970_have_the_unit_of_their_size(
    tmp_path: Path, unit: str, per_s: float
) -> None:
    counts = np.round((1710032340.0 + np.arange(COUNT)) * per_s).astype(np.int64)
    written(tmp_path / "a.csv", "timestamp", [str(count) for count in counts])
    record = read_record(str(tmp_path / "a.csv"))
    assert record.time == pytest.approx(np.arange(COUNT), abs=1e-6)
    assert record.clock_unit == unit


def test_unit_of_times_that_have_none_is_given_by_a_key(tmp_path: Path) -> None:
    written(tmp_path / "a.csv", "time", [str(10 * k) for k in range(COUNT)])
    (record,) = read_records([str(tmp_path / "a.csv")], time_unit="ms")
    assert record.time == pytest.approx(SECONDS)
    written(tmp_path / "a.csv", "time [min]", [str(10 * k) for k in range(COUNT)])
    (record,) = read_records([str(tmp_path / "a.csv")], time_unit="ms")
    assert record.time[1] == 600


def test_lapses_of_time_are_read_from_text_and_parquet(tmp_path: Path) -> None:
    lapses = pd.to_timedelta(SECONDS, unit="s")
    written(tmp_path / "a.csv", "elapsed", [str(lapse) for lapse in lapses])
    pq.write_table(pa.table({"elapsed": lapses, "u": np.arange(COUNT)}), tmp_path / "a.parquet")
    for name in ("a.csv", "a.parquet"):
        record = read_record(str(tmp_path / name))
        assert record.clock == "elapsed"
        assert record.time == pytest.approx(SECONDS)


@pytest.mark.parametrize("name", [None, "when", "time"])
@pytest.mark.parametrize("kind", ["dates", "seconds", "lapses"])
def test_times_in_the_index_of_a_parquet_table_are_its_clock(
    tmp_path: Path, name: str | None, kind: str
) -> None:
    lapses = pd.to_timedelta(TIME, unit="s")
    index = {"dates": pd.Timestamp("2024-05-01") + lapses, "lapses": lapses}.get(kind, TIME)
    table = pd.DataFrame({"u": ROAD}, index=pd.Index(index, name=name))
    table.to_parquet(tmp_path / "a.parquet")
    if kind == "seconds" and name == "when":
        with pytest.raises(NoTimesError, match="name it with time"):
            read_record(str(tmp_path / "a.parquet"))
    record = read_record(str(tmp_path / "a.parquet"), ["u"], time=name)
    assert record.time == pytest.approx(TIME, abs=1e-9)


def test_index_of_samples_is_no_clock_even_with_lost_rows(tmp_path: Path) -> None:
    table = pd.DataFrame({"time": TIME, "u": ROAD}).drop(index=[3, 50])
    table.to_parquet(tmp_path / "a.parquet")
    table.to_csv(tmp_path / "a.csv")
    for name in ("a.parquet", "a.csv"):
        record = read_record(str(tmp_path / name))
        assert (record.clock, list(record.columns)) == ("time", ["u"])


def test_times_of_day_in_a_parquet_table_are_read(tmp_path: Path) -> None:
    dates = pd.Timestamp("2024-05-01 10:00") + pd.to_timedelta(SECONDS, unit="s")
    columns = {
        "day": pa.array(dates.date, pa.date32()),
        "at": pa.array(dates.time, pa.time64("us")),
        "u": pa.array(np.arange(COUNT)),
    }
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    record = read_record(str(tmp_path / "a.parquet"), ["u"], time="at")
    assert np.diff(record.time) == pytest.approx(np.full(COUNT - 1, 0.01))
