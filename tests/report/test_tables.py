"""What a training searched for is told in tables, on the report and on the console."""

from __future__ import annotations

import pytest
from rich.console import Console

from slide_fmu.core.figures import plain, read_figures
from slide_fmu.fitting.history import Curve, CurvePoint, SizeTrial
from slide_fmu.report.console import print_curve, print_sizes
from slide_fmu.report.html_report import Report
from slide_fmu.report.learning_sections import curve_section, sizes_section
from slide_fmu.report.learning_tables import curve_table, size_table
from slide_fmu.report.table import ReportTable, markdown

SIZES = (SizeTrial(4, 0, 26, 0.0912, 0.08), SizeTrial(4, 16, 290, None, None))
CURVE = Curve(
    (CurvePoint(8, 0.25, 0.125, 3.2), CurvePoint(16, 0.0625, 0.05, 6.0)), "it was enough"
)
REMARK = "much could still be learnt"


def test_sizes_stand_with_their_errors() -> None:
    assert size_table(SIZES).heading[:2] == ("order", "hidden units")
    assert size_table(SIZES).rows == (
        ("4", "0", "26", "9.12 %", "8 %"),
        ("4", "16", "290", "", ""),
    )


def test_sizes_of_records_stand_with_their_spread() -> None:
    sizes = SizeTrial(4, 16, 290, 0.05, 0.01, 0.02, 0.125), SIZES[1]
    assert size_table(sizes).heading[3:6] == ("validation error", "best block", "worst block")
    assert [row[3:] for row in size_table(sizes).rows] == [
        ("5 %", "2 %", "12.5 %", "1 %"),
        ("", "", "", ""),
    ]


def test_curve_stands_with_its_numbers_and_times() -> None:
    assert curve_table(CURVE).rows == (
        ("8", "25 %", "12.5 %", "3"),
        ("16", "6.25 %", "5 %", "6"),
    )
    assert read_figures(Curve, plain(CURVE)) == CURVE


def test_report_shows_sizes_curve_and_remark() -> None:
    sections = [sizes_section(SIZES, ["16 units pay"], REMARK), curve_section(CURVE)]
    page = Report("title", "summary", {}, sections).html()
    for text in (
        "9.12 %",
        "290",
        "16 units pay.",
        f"Remark: {REMARK}.",
        "6.25 %",
        "The curve ended: it was enough",
    ):
        assert text in page
    assert page.count("data-chart=") == 1
    assert "Remark" not in Report("title", "", {}, [sizes_section(SIZES, (), None)]).html()


def test_console_shows_sizes_and_curve(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(width=200)
    print_curve(CURVE, console)
    print_sizes(SIZES, ["16 units pay"], console)
    shown = capsys.readouterr().out
    for text in ("9.12 %", "16 units pay.", "6.25 %", "The learning curve ended: it was enough."):
        assert text in shown


def test_table_is_the_same_without_columns_in_which_nothing_stands() -> None:
    table = ReportTable.of(
        ("name", "size", "", "error"), [("a", "", "x", "1"), ("b", "", "", "2")]
    )
    assert table.without_empty_columns().heading == ("name", "", "error")
    assert table.columns("error", "none", "name").rows == (("1", "a"), ("2", "b"))


def test_markdown_of_a_table_has_a_line_below_its_heading() -> None:
    table = ReportTable.of(("name", ""), [("a", "1"), ("b", "")])
    assert markdown(table).splitlines() == [
        "| name | |",
        "| --- | --- |",
        "| a | 1 |",
        "| b |  |",
    ]
