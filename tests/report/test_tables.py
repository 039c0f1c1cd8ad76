"""What a training searched for is told in tables, on the report and on the console."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from slide_fmu.cli.findings import show_search
from slide_fmu.fitting.history import Curve, CurvePoint, TriedSize
from slide_fmu.report.learning_sections import curve_section, sizes_section
from slide_fmu.report.report import Report
from slide_fmu.report.tables import curve_rows, size_rows

SIZES = [asdict(TriedSize(4, 0, 26, 0.0912, 0.08)), asdict(TriedSize(4, 16, 290, None, None))]
CURVE = Curve(
    (CurvePoint(8, 0.25, 0.125, 3.2), CurvePoint(16, 0.0625, 0.05, 6.0)), "it was enough"
)
REMARK = "much could still be learnt"


def test_sizes_stand_with_their_errors() -> None:
    assert size_rows(SIZES)[1:] == [
        ("4", "0", "26", "0.0912", "0.08"),
        ("4", "16", "290", "", ""),
    ]


def test_curve_stands_with_its_numbers_and_times() -> None:
    assert curve_rows(CURVE.figures())[1:] == [
        ("8", "0.25", "0.125", "3"),
        ("16", "0.0625", "0.05", "6"),
    ]
    assert Curve.of_figures(CURVE.figures()) == CURVE


def test_report_shows_sizes_curve_and_remark() -> None:
    sections = [sizes_section(SIZES, REMARK), curve_section(CURVE.figures())]
    page = Report("title", "summary", {}, sections).html()
    for text in (
        "0.0912",
        "290",
        f"Remark: {REMARK}.",
        "0.0625",
        "The curve ended: it was enough",
    ):
        assert text in page
    assert page.count("data-chart=") == 1
    assert "Remark" not in Report("title", "", {}, [sizes_section(SIZES, None)]).html()


def test_console_shows_sizes_curve_and_remark(capsys: pytest.CaptureFixture[str]) -> None:
    figures = {"sizes_tried": SIZES, "remark": REMARK, "learning_curve": CURVE.figures()}
    show_search(figures)
    told = capsys.readouterr().err
    for text in ("0.0912", "0.0625", "it ended: it was enough", f"remark: {REMARK}"):
        assert text in told
