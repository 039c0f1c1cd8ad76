"""A report is written as one HTML file with charts and tables, and as JSON with its figures."""

from __future__ import annotations

import datetime
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from slide_fmu.core.figures import plain
from slide_fmu.core.files import write_whole
from slide_fmu.core.version import __version__
from slide_fmu.core.web.charts import Bar, Chart, Columns, HeatMap, plain_chart
from slide_fmu.core.web.packing import MODULES, packed, scripts, styles
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.table import ReportTable

WEB = Path(__file__).parent / "web"

LONGEST_BAR = 70.0
"""Width of the longest bar in per cent; its text stands behind it."""

STACKED_COLUMNS, LONGEST_CELL = 3, 60
"""Tables of these columns, with a cell of more characters, are stacked on narrow screens."""

BLOCK_COLUMNS = 5
"""Tables of this many columns show each row as a block on narrow screens."""


def coded(text: str) -> Markup:
    """Return a text as HTML, in which names between backticks are set as code."""
    parts = text.split("`")
    if len(parts) % 2 == 0:  # one has no partner
        return escape(text)
    tags = ("{}", "<code>{}</code>")
    return Markup("").join(Markup(tags[k % 2]).format(part) for k, part in enumerate(parts))


@dataclass(frozen=True, eq=False)
class ReportSection:
    """A section is one part of a report.

    Attributes:
        title: heading.
        text: explanation of the section and how to read it.
        table: figures in words.
        charts: what the page draws itself.
        bars: sizes, drawn as bars.
        maps: tables of coloured values.
        folded: whether only the title is shown until the reader opens it.
    """

    title: str
    text: str
    table: ReportTable | None = None
    charts: Sequence[Chart] = ()
    bars: Sequence[Bar] = ()
    maps: Sequence[HeatMap] = ()
    folded: bool = False


@dataclass(frozen=True)
class Fact:
    """A Fact is one of the few large numbers of a verdict.

    Attributes:
        name: what it is about.
        value: the number with its unit.
        text: what the number says.
        good: whether it is as it should be; None where nothing is expected.
    """

    name: str
    value: str
    text: str
    good: bool | None = None


@dataclass(frozen=True, eq=False)
class Verdict:
    """A Verdict stands above all else in a report.

    Attributes:
        sentences: the most important facts in a few sentences.
        facts: the same in large numbers.
        commands: what each command does, and the command.
    """

    sentences: tuple[str, ...] = ()
    facts: Sequence[Fact] = ()
    commands: Sequence[tuple[str, str]] = ()

    def __bool__(self) -> bool:
        """Tell whether there is something to show."""
        return bool(self.sentences or self.facts or self.commands)


@dataclass(frozen=True, eq=False)
class Report:
    """A Report has a summary of the FMU, its figures, and the sections that show them.

    Attributes:
        title, summary: heading, and what stands below it.
        figures: a dataclass or plain values; JSON has their dump.
        sections: the sections, in this order.
        inside: a whole page of HTML, shown behind the sections; no page if None.
        verdict: shown above all else.
    """

    title: str
    summary: str
    figures: object
    sections: list[ReportSection] = field(default_factory=list)
    inside: str | None = None
    verdict: Verdict = field(default_factory=Verdict)

    def html(self, date: datetime.date | None = None) -> str:
        """Return the whole report as one self-contained page; folded sections come last.

        It names the day, if there is one: the page in an FMU is the same on each day.
        """
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("slide_fmu.report"), autoescape=True, trim_blocks=True
        )
        environment.filters["coded"] = coded
        columns, sections = Columns(), []
        charts: list[Any] = []
        for section in sorted(self.sections, key=lambda one: one.folded):
            first = len(charts)
            charts += [plain_chart(chart, columns) for chart in section.charts]
            sections.append({**_shown(section), "charts": range(first, len(charts))})
        content = {"columns": columns.values, "charts": charts}
        drawn = json.dumps(content, separators=(",", ":"))
        return environment.get_template("report.html").render(
            report=self,
            sections=sections,
            drawn=bool(charts),
            version=__version__,
            date="" if date is None else f"{date:%d %B %Y}, ".lstrip("0"),
            charts=packed(drawn.encode("utf-8")),
            style=styles(MODULES / "charts.css", WEB / "report.css"),
            **scripts(WEB / "report.js"),
        )

    def write(self, folder: Path) -> Path:
        """Write ``report.html`` and ``report.json``, and return the path of the page.

        A missing folder is made.
        """
        figures = self.figures
        values = figures.dump() if isinstance(figures, RunFigures) else plain(figures)
        text = json.dumps(values, indent=2)
        write_whole(folder / "report.json", (text + "\n").encode("utf-8"))
        path = folder / "report.html"
        write_whole(path, self.html(datetime.date.today()).encode("utf-8"))
        return path


def _shown(section: ReportSection) -> dict[str, object]:
    """Return a section for the template; the longest bar has the length ``LONGEST_BAR``."""
    largest = max((bar.size for bar in section.bars), default=0.0) or 1.0
    return {
        **vars(section),
        "layout": "" if section.table is None else _layout(section.table),
        "bars": [{**vars(bar), "share": LONGEST_BAR * bar.size / largest} for bar in section.bars],
    }


def _layout(table: ReportTable) -> str:
    """Return how a table fits narrow screens: ``blocks``, ``stacked``, or empty if as it is.

    Of stacked tables, phones show a row's cells below each other, behind the first one.
    """
    longest = max((len(cell) for row in table.rows for cell in row), default=0)
    if len(table.heading) == STACKED_COLUMNS and longest > LONGEST_CELL:
        return "stacked"
    return "blocks" if len(table.heading) >= BLOCK_COLUMNS else ""


def folded(sections: Iterable[ReportSection]) -> list[ReportSection]:
    """Return sections of which only the titles are shown at first."""
    return [replace(section, folded=True) for section in sections]


def remark_sections(remarks: Sequence[str]) -> list[ReportSection]:
    """Show remarks in a section of their own, if there are any."""
    if not remarks:
        return []
    return [
        ReportSection(
            "Remarks", " ".join(f"{remark[0].upper()}{remark[1:]}." for remark in remarks)
        )
    ]
