"""Text files are read however they are written, and malformed ones are refused."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.record_files.reading import read_record, read_records
from slide_fmu.record_files.record import RecordError
from slide_fmu.record_files.table import TextForm
from slide_fmu.records.findings import examine
from tests.records.files import ROAD, TIME, TRAVEL, as_csv
from tests.refusals import refused


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
    quote = '"' if separator == decimal else ""
    ends = {"brackets": " [{}]", "parentheses": " ({})"}.get(units, "")
    header = separator.join(
        n + ends.format(u) for n, u in (("t", "ms"), ("road", "m"), ("y", "°C"))
    )
    second = [separator.join(("ms", "m", "°C"))] if units == "second line" else []
    rows = [
        separator.join(f"{quote}{v:.4f}{quote}".replace(".", decimal) for v in row)
        for row in zip(1000 * TIME, ROAD, TRAVEL, strict=True)
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *second, *rows]) + "\n", encoding="utf-8")
    # that commas are decimal where blanks separate is no simple guess
    form = TextForm(separator, decimal) if (separator, decimal) == (" ", ",") else None
    (record,) = read_records([str(path)], form=form)
    scale = 1.0 if units == "none" else 1e-3
    assert record.time == pytest.approx(scale * 1000 * TIME, abs=1e-9)
    assert record.columns["road"] == pytest.approx(ROAD, abs=5.1e-5)
    assert record.columns["y"] == pytest.approx(TRAVEL, abs=5.1e-5)
    told = {"road": "", "y": ""} if units == "none" else {"road": "m", "y": "°C"}
    assert record.units == told
    assert record.place(0).startswith("sample 1 (line 3" if second else "sample 1 (line 2")


@pytest.mark.parametrize(
    "text",
    [
        't,u,y\n0,"1,5",2\n1,"-2,5e1",3\n',  # only what has a comma is within quotes
        '"t", "u", "y"\n"0,0", "1,5", "2"\n"1,0", "-25", "3"\n',
        'time,u,y\n"2024-05-01 12:00:00,5","1,5",2\n"2024-05-01 12:00:01,5","-25,0",3\n',
        't,u,y\n"0,000","1,500","2,000"\n"1,000","-25,000","3,000"\n',
        '\ufefft;u;y\n"0,0";"1,5";"2"\n"1,0";"-25,0";"3"\n',
        "Run 7;;\r\nt;u;y\r\ns;N;mm\r\n0,0;1,5;2\r\n1,0;-25;3\r\n",
        "Run\t7\t\nt [s]\tu\ty\n0,0\t1,5\t2\n1,0\t-25\t3\n",
        't, u, y\n"s", "N", "mm"\n0.0, 1.5, 2\n1.0, -25, 3\n',
        "\ufeff# t , u , y\n 0 , 1.5 , 2 \n 1 , -25 , 3 \n",
    ],
)
def test_odd_files_hold_the_same_record(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_bytes(text.encode("utf-8"))
    for names in (None, ["u", "y"]):
        record = read_record(str(tmp_path / "a.csv"), names)
        assert record.time.tolist() == [0, 1]
        assert {n: v.tolist() for n, v in record.columns.items()} == {"u": [1.5, -25], "y": [2, 3]}


def test_commas_within_quotes_that_may_group_thousands_are_refused(tmp_path: Path) -> None:
    rows = [f'"{1 + k},000","{2 + k},500"' for k in range(100)]
    as_csv(tmp_path / "a.csv", "\n".join(["t,u", *rows]))
    with refused(RecordError, "a.csv", "'1,000'", "expected", "'0,5'", "write decimal points"):
        read_record(str(tmp_path / "a.csv"))
    as_csv(tmp_path / "a.csv", "\n".join(["t,u", '"0,000","1,500"', *rows]))
    assert read_record(str(tmp_path / "a.csv")).columns["u"].tolist() == [
        1.5 + k for k in range(101)
    ]


@pytest.mark.parametrize(
    ("rows", "texts"),
    [
        (['"0,1","1,5"', '"0,2","1.5"', '"0,3","2,5"'], [("u", 1, "1.5")]),
        (['0.1,"1,5"', "0.2,2.5", "0.3,3.5"], [("u", 0, "1,5")]),
        (['0.1,"1,234"', "0.2,999", "0.3,998.5"], [("u", 0, "1,234")]),
        (['"0,1","1.234,5"', '"0,2","999,5"'], [("u", 0, "1.234,5")]),
    ],
)
def test_numbers_of_the_rarer_decimal_sign_are_texts(
    tmp_path: Path, rows: list[str], texts: list[tuple[str, int, str]]
) -> None:
    as_csv(tmp_path / "a.csv", "\n".join(["t,u", *rows]))
    record = read_record(str(tmp_path / "a.csv"))
    assert [(text.column, text.sample, text.value) for text in record.texts] == texts
    (message,) = (one.message for one in examine([record], ["u"]) if one.kind == "text")
    assert f"a.csv, column 'u': the text {texts[0][2]!r} at sample" in message
    assert "expected numbers throughout: mend the file" in message


def test_decimal_comma_without_quotes_is_refused(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", 't,u\n"0,1","1,5"\n0,2,1,5\n"0,3","2,5"\n')
    with refused(RecordError, "a.csv", "line 3", "expected 2 values in each line"):
        read_record(str(tmp_path / "a.csv"))


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
    monkeypatch.setattr("slide_fmu.record_files.csv_file.CHUNK", 30)
    rows = [f"{0.1 * k:.1f},{k},{k}" for k in range(100)]
    rows[57] = "5.7,fault,57"
    rows[80] = "8.0,over,80"
    as_csv(tmp_path / "a.csv", "\n".join(["t,u,y", *rows]))
    record = read_record(str(tmp_path / "a.csv"))
    (text,) = record.texts
    assert (text.column, text.count, text.sample, text.value) == ("u", 2, 57, "fault")
    assert record.place(text.sample).startswith("sample 58 (line 59, t = 5.7 s)")
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
        ("t\n0\n1\n", "at least one column other than the time"),
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


@pytest.mark.extended
def test_large_csv_is_refused_within_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with path.open("w", encoding="utf-8") as file:
        file.write("t,u,y\n")
        for k in range(50):
            file.write("".join(f"{k}.{i:06d},1.5,2.5\n" for i in range(40_000)))
    read_record(str(tmp_path / "a.csv"), ["u"], most=10**8)  # what is loaded once does not count
    tracemalloc.start()
    with refused(RecordError, "at least", "samples of 3 columns"):
        read_record(str(path), most=200_000)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 0.5 * path.stat().st_size + 40e6


def test_csv_of_two_bytes_for_each_character_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t\tu [°C]\n0\t1\n1\t2\n", encoding="utf-16")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.units == {"u": "°C"}
    assert record.columns["u"].tolist() == [1, 2]


def test_lines_of_a_title_above_the_names_are_passed_over(tmp_path: Path) -> None:
    title = "Test bench 7, run 13\nDate: 2024-05-01\n\n"
    for names, unit in (("t,u,y", ""), ("t,u,y\ns,N,mm", "mm")):
        as_csv(tmp_path / "a.csv", f"{title}{names}\n0,1,2\n0.1,2,3\n0.2,3,fault\n")
        record = read_record(str(tmp_path / "a.csv"))
        assert record.columns["u"].tolist() == [1, 2, 3]
        assert record.units["y"] == unit
        assert f"line {8 if unit else 7}," in record.place(2)


def test_numbers_above_the_samples_are_no_samples(tmp_path: Path) -> None:
    title = "Sample rate,100\nChannels,2\n\nt,u,y\n"
    as_csv(tmp_path / "a.csv", f"{title}0,1,2\n0.1,2,3\n0.2,3,4\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert {n: v.tolist() for n, v in record.columns.items()} == {"u": [1, 2, 3], "y": [2, 3, 4]}


def test_names_that_are_numbers_need_the_key_of_their_line(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,1,2\n0,1,2\n0.1,2,3\n0.2,3,4\n")
    with refused(RecordError, "a.csv", "If the names are numbers: --read header=LINE"):
        read_record(str(tmp_path / "a.csv"))
    (record,) = read_records([str(tmp_path / "a.csv")], form=TextForm(header=1))
    assert {n: v.tolist() for n, v in record.columns.items()} == {"1": [1, 2, 3], "2": [2, 3, 4]}


@pytest.mark.parametrize("names", [None, ["u", "y"]])
@pytest.mark.parametrize("units", ["", "s,N,mm\n"])
@pytest.mark.parametrize(
    "title",
    [
        "Measurement 12,,\n",
        "Measurement 12,,\nby hand,,\n,,\n",
        "Measurement,12,with oil\n",
        "Measurement,warm,with oil\n",
        "Sample rate,100,\nChannels,2,\n\n",
        "Sensor A,,Sensor B\n",
    ],
)
def test_title_with_as_many_values_as_a_sample_is_passed_over(
    tmp_path: Path, title: str, units: str, names: list[str] | None
) -> None:
    as_csv(tmp_path / "a.csv", f"{title}t,u,y\n{units}0,1,2\n0.1,2,3\n0.2,3,4\n")
    record = read_record(str(tmp_path / "a.csv"), names)
    assert {n: v.tolist() for n, v in record.columns.items()} == {"u": [1, 2, 3], "y": [2, 3, 4]}
    assert record.units == ({"u": "N", "y": "mm"} if units else {"u": "", "y": ""})
    assert record.first_line == 1 + (title + units).count("\n") + 1


def test_units_without_one_of_time_need_the_line_of_the_names(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "Run,oil\nV,m\n0,1\n1,2\n")
    record = read_record(str(tmp_path / "a.csv"), ["V", "m"], step=0.1)
    assert (record.columns["m"].tolist(), record.units) == ([1, 2], {"V": "", "m": ""})
    as_csv(tmp_path / "a.csv", "V,m\nV,t\n0,1\n1,2\n")  # these are volts and tonnes
    (record,) = read_records(
        [str(tmp_path / "a.csv")], ["V", "m"], step=0.1, form=TextForm(header=1)
    )
    assert (record.columns["m"].tolist(), record.units) == ([1, 2], {"V": "V", "m": "t"})


@pytest.mark.parametrize("title", ["Run 12,,\n", "Run,12,13\n"])
def test_names_stand_right_above_the_samples(tmp_path: Path, title: str) -> None:
    as_csv(tmp_path / "a.csv", f"{title}t,u,y\n0,1,2\n1,2,3\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert {n: v.tolist() for n, v in record.columns.items()} == {"u": [1, 2], "y": [2, 3]}


@pytest.mark.parametrize("header", [0, 9])
def test_header_that_is_no_line_is_refused(tmp_path: Path, header: int) -> None:
    as_csv(tmp_path / "a.csv", "t,u\n0,1\n1,2\n")
    with refused(RecordError, f"no names in line {header}", "the given header"):
        read_records([str(tmp_path / "a.csv")], form=TextForm(header=header))


def test_words_of_a_title_are_no_names_where_blanks_separate(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "Run 13 of day 7\nwith oil\n# t u y\n0.0 1 2\n0.1 2 3\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.time.tolist() == [0.0, 0.1]
    assert {name: v.tolist() for name, v in record.columns.items()} == {"u": [1, 2], "y": [2, 3]}


def test_names_that_are_too_few_are_no_title(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u\n0,1,2\n1,2,3\n2,3,4\n")
    with refused(RecordError, "a.csv", "expected 2 values", "2 values in"):
        read_record(str(tmp_path / "a.csv"))


def test_form_that_is_guessed_wrongly_is_refused_with_the_keys(tmp_path: Path) -> None:
    """Blanks separate, and commas are decimal."""
    as_csv(tmp_path / "a.csv", "t u y\n0,0 1,5 2,0\n0,1 2,5 3,0\n")
    words = "line 2 has 4 values; expected 1 values", "--read separator=SIGN, decimal=SIGN"
    with refused(RecordError, "a.csv", *words):
        read_record(str(tmp_path / "a.csv"), ["u", "y"])
    (record,) = read_records([str(tmp_path / "a.csv")], ["u", "y"], form=TextForm(" ", ","))
    assert record.columns["u"].tolist() == [1.5, 2.5]


def test_header_above_nothing_is_refused_with_its_file_and_line(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u\ns,N\n")
    with refused(RecordError, "expected a line", "3 on"):
        read_record(str(tmp_path / "a.csv"))


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
@pytest.mark.parametrize("short", [1, 2, 3])
def test_line_of_fewer_values_than_names_is_refused(
    tmp_path: Path, separator: str, short: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slide_fmu.record_files.csv_file.CHUNK", 30)
    rows = [separator.join([f"{0.1 * k:.1f}", str(k), str(k), str(k)]) for k in range(50)]
    rows[37] = separator.join(rows[37].split(separator)[:short])
    as_csv(tmp_path / "a.csv", "\n".join([separator.join("tuvy"), *rows]))
    with pytest.raises(RecordError, match=f"line 39 has {short} values; expected 4 values"):
        read_record(str(tmp_path / "a.csv"))


def test_line_whose_last_values_are_empty_is_a_sample(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u,y\n0,1,2\n1,2,\n2,,nan\n3,4,5\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.columns["y"] == pytest.approx([2, np.nan, np.nan, 5], nan_ok=True)


@pytest.mark.parametrize("sign", ["T", " "])
@pytest.mark.parametrize("zone", ["", "Z", "+02:00"])
def test_dates_become_seconds_since_the_first(
    tmp_path: Path, sign: str, zone: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slide_fmu.record_files.csv_file.CHUNK", 30)
    dates = [f"2024-05-01{sign}12:00:{0.01 * k:09.6f}{zone}" for k in range(100)]
    rows = [f"{date};{k}" for k, date in enumerate(dates)]
    as_csv(tmp_path / "a.csv", "\n".join(["time;u", *rows]))
    record = read_record(str(tmp_path / "a.csv"))
    assert record.time == pytest.approx(0.01 * np.arange(100), abs=1e-9)
    assert (record.clock, record.clock_unit, record.texts) == ("time", "s", ())


def test_text_among_dates_is_found(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "time,u\n2024-05-01 12:00:00,1\nlater,2\n2024-05-01 12:00:01,3\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert record.time == pytest.approx([0, np.nan, 1], nan_ok=True)
    assert [(t.column, t.sample, t.value) for t in record.texts] == [("time", 1, "later")]


def test_index_of_a_table_counts_samples_or_is_the_time(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", ",time [s],u\n0,0.0,1\n1,0.1,2\n2,0.2,3\n")
    record = read_record(str(tmp_path / "a.csv"))
    assert (record.clock, list(record.columns)) == ("time", ["u"])
    as_csv(tmp_path / "a.csv", ",u\n2024-05-01 12:00:00,1\n2024-05-01 12:00:02,2\n")
    for names in (None, ["u"]):
        record = read_record(str(tmp_path / "a.csv"), names)
        assert (record.time.tolist(), list(record.columns)) == ([0, 2], ["u"])


def test_one_among_units_is_that_of_a_ratio(tmp_path: Path) -> None:
    as_csv(tmp_path / "a.csv", "t,u,slip,y\ns,N,1,mm\n0,1,2,3\n1,2,3,4\n")
    assert read_record(str(tmp_path / "a.csv")).units == {"u": "N", "slip": "1", "y": "mm"}
    as_csv(tmp_path / "a.csv", "t,u,slip\n1,fault,1\n2,2,3\n")
    assert [text.value for text in read_record(str(tmp_path / "a.csv")).texts] == ["fault"]
