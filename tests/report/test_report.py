"""The report is one page that needs nothing else."""

from __future__ import annotations

import datetime
import json
import re
from pathlib import Path

import numpy as np
import pytest

from slide_fmu import __version__
from slide_fmu.core.web.charts import Bar, Chart, HeatCell, HeatMap, Line, Panel
from slide_fmu.report.html_report import LONGEST_BAR, Fact, Report, ReportSection, Verdict
from slide_fmu.report.row_tables import card_table
from slide_fmu.report.table import ReportTable
from tests.browser import Browser
from tests.charts import charts_of
from tests.report.made_rows import row

X = np.arange(5.0)
KINDS = ("held_random", "a fast sine of 2.5 to 6.6 Hz with an amplitude of 470 to 880 N")


def _chart(title: str) -> Chart:
    return Chart(title, [Panel("size", "m", [Line("x", X, X)])])


def test_report_names_no_address_beside_those_of_its_own_parts() -> None:
    section = ReportSection(
        "a", "b", ReportTable.of(("x",), [("1",)]), [_chart("c")], [Bar("d", 1, "e")]
    )
    page = Report("title", "summary", {}, [section, section]).html()
    addresses = re.findall(r"""(?:src|href)="([^"]*)"|@import|url\(|https?:""", page)
    assert addresses
    assert all(address.startswith("#part-") for address in addresses)


def test_charts_stand_in_the_sections_that_they_belong_to() -> None:
    sections = [
        ReportSection("one", "", charts=[_chart("first"), _chart("second")]),
        ReportSection("two", "", charts=[_chart("third")]),
    ]
    page = Report("title", "summary", {}, sections).html()
    assert [chart["title"] for chart in charts_of(page)["charts"]] == ["first", "second", "third"]
    parts = re.findall(r"<section.*?</section>", page, re.DOTALL)
    assert [re.findall(r'data-chart="(\d)"', part) for part in parts] == [["0", "1"], ["2"]]


def test_texts_of_users_do_not_become_html() -> None:
    section = ReportSection(
        "<b>a</b>", "<i>b</i>", ReportTable.of(("<u>",), [("<s>",)]), [_chart("</script>")]
    )
    page = Report("<h1>", "<em>", {}, [section]).html()
    assert not re.findall(r"<(?:b|i|u|s|em)>", page)
    assert page.count("</script>") == 3


def test_verdict_stands_above_open_sections_and_folded_ones_come_last() -> None:
    sections = [
        ReportSection("first", "", charts=[_chart("hidden")], folded=True),
        ReportSection("second", "", charts=[_chart("seen")]),
    ]
    facts = [Fact("Error", "1 %", "a text", good=True), Fact("Memory", "2 s", "another")]
    verdict = Verdict(("One sentence.",), facts, [("Read it", "slide-fmu info x.fmu")])
    page = Report("title", "summary", {}, sections, verdict=verdict).html()
    words = "1 %", "One sentence.", "slide-fmu info x.fmu", "<h2>second</h2>", "<h2>first</h2>"
    places = [page.index(word) for word in words]
    assert places == sorted(places)
    assert [chart["title"] for chart in charts_of(page)["charts"]] == ["seen", "hidden"]
    assert page.count('class="good"') == 1
    assert 'href="#part-1">second' in page
    assert 'href="#part-2">first' in page


def test_report_has_its_date_and_the_version() -> None:
    report = Report("title", "summary", {})
    assert f">slide-fmu {__version__}<" in report.html()  # in an FMU
    page = report.html(datetime.date(2026, 3, 7))
    assert f">7 March 2026, slide-fmu {__version__}<" in page


def test_heat_map_needs_no_script_and_colours_its_cells() -> None:
    cells = [
        [HeatCell("1 %", 0.0, "2 pieces"), None],
        [HeatCell("3 %", 1.0), HeatCell("2 %", 0.5)],
    ]
    heat = HeatMap("errors", "", "frequency / Hz", "part", ("a", "b"), ("c", "d"), cells)
    page = Report("title", "", {}, [ReportSection("s", "", maps=[heat])]).html()
    assert re.findall(r"--level: (\d+)%", page) == ["0", "50", "25"]
    assert 'title="2 pieces">1 %</td><td></td>' in page


def test_longest_bar_has_the_whole_length_and_others_their_part() -> None:
    bars = [Bar("a", 4.0, "4"), Bar("b", 1.0, "1"), Bar("c", 0.0, "0")]
    page = Report("title", "summary", {}, [ReportSection("s", "", bars=bars)]).html()
    widths = [float(text) for text in re.findall(r"width: ([\d.]+)%", page) if text != "100"]
    assert widths[-3:] == [LONGEST_BAR, LONGEST_BAR / 4, 0.0]


def test_page_inside_is_the_last_section(tmp_path: Path) -> None:
    report = Report(
        "title", "summary", {"a": 1}, [ReportSection("s", "")], inside='<p class="x">&</p>'
    )
    page = report.write(tmp_path).read_text(encoding="utf-8")
    assert 'srcdoc="&lt;p class=&#34;x&#34;&gt;&amp;&lt;/p&gt;"' in page
    assert page.index("<h2>s</h2>") < page.index("<h2>Touch it</h2>")
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8")) == {"a": 1}
    assert "Touch it" not in Report("title", "summary", {}).html()


def test_tables_of_long_texts_are_stacked_on_narrow_screens() -> None:
    heading = ("", "inputs", "measured")
    long = ReportTable(heading, (("valid", "force is " + 60 * "x", "small"),))
    short = ReportTable(heading, (("valid", "force", "small"),))
    for table, stacked in ((long, True), (short, False)):
        page = Report("title", "", {}, [ReportSection("one", "", table)]).html()
        assert ('class="table stacked"' in page) == stacked


@pytest.mark.parametrize("columns", [5, 11])
def test_wide_tables_fit_small_screens_and_phones(
    chromium: Browser, tmp_path: Path, columns: int
) -> None:
    wide = card_table([row(name, steps=steps) for name in KINDS for steps in (1.0, 4.0)])
    assert len(wide.heading) == 11
    table = ReportTable.of(wide.heading[:columns], [cells[:columns] for cells in wide.rows])
    cell = HeatCell("0.0825 %, 58.4 % (12)", 0.5)
    bands = [f"{2**n} to {2 ** (n + 1)} Hz" for n in range(5)]
    tones = HeatMap("Tones", "", "", "amplitude", bands, ["10 to 50 %"], [[cell] * len(bands)])
    report = Report("title", "", {}, [ReportSection("Rows", "", table, maps=[tones])])
    page = report.write(tmp_path)
    cut = "[...document.querySelectorAll('.table')].filter(t => t.scrollWidth > t.clientWidth)"
    for width in (400, 1200, 1340):
        chromium.resize(width, 900)
        chromium.open(page)
        assert chromium.evaluate(f"{cut}.length") == 0, width


def test_names_between_backticks_are_set_as_code() -> None:
    table = ReportTable(("name",), (("`trusted` < 1 {x}",),))
    section = ReportSection("Rows", "Set `inputs_held` = 1 & wait.", table)
    report = Report("title", "summary", {}, [section], verdict=Verdict(("One ` alone.",)))
    page = report.html()
    assert "Set <code>inputs_held</code> = 1 &amp; wait." in page
    assert "<code>trusted</code> &lt; 1 {x}" in page
    assert "One ` alone." in page
