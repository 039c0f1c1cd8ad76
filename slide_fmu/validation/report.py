"""The report of a surrogate has its figures as JSON, pictures and tables as one HTML file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2

from slide_fmu.core.files import write_whole
from slide_fmu.validation.pictures import in_page


@dataclass(frozen=True, eq=False)
class Section:
    """A section is one part of a report.

    Attributes:
        title: heading.
        text: what is seen here and how to read it.
        rows: table, whose first row is the heading; it may be empty.
        pictures: PNG bytes.
    """

    title: str
    text: str
    rows: Sequence[Sequence[str]] = ()
    pictures: Sequence[bytes] = ()


@dataclass(frozen=True, eq=False)
class Report:
    """A report says what the FMU is, with its figures, and the sections that show them."""

    title: str
    summary: str
    data: dict[str, Any]
    sections: list[Section] = field(default_factory=list)

    def html(self) -> str:
        """Return the whole report as one self-contained page."""
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("slide_fmu.validation"), autoescape=True, trim_blocks=True
        )
        pictures = [
            [in_page(picture) for picture in section.pictures] for section in self.sections
        ]
        template = environment.get_template("report.html")
        return template.render(report=self, sections=zip(self.sections, pictures, strict=True))

    def write(self, folder: Path) -> Path:
        """Write ``report.html`` and ``report.json``, and return the path of the page.

        The folder is made where there is none.
        """
        text = json.dumps(self.data, indent=2)
        write_whole(folder / "report.json", (text + "\n").encode("utf-8"))
        path = folder / "report.html"
        write_whole(path, self.html().encode("utf-8"))
        return path


def remark_sections(remarks: Sequence[str]) -> list[Section]:
    """Show remarks in a section of their own, if there are any."""
    if not remarks:
        return []
    return [
        Section("Remarks", " ".join(f"{remark[0].upper()}{remark[1:]}." for remark in remarks))
    ]
