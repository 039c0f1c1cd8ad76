"""A page in the FMU explains its related files; the main page gets links to it."""

from __future__ import annotations

from collections.abc import Sequence

import jinja2

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import Experiment
from slide_fmu.apps.credentials.manifest import Related
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.attachments.files import LICENSES
from slide_fmu.pipeline.documents import CARD, PAGE

FOOTER = "<!-- links of the FMU -->"
END = "</body>"


def references_page(
    name: str, files: Sequence[Related], experiment: Experiment | None, shifted: bool
) -> bytes:
    """Write the page about related files as HTML.

    Args:
        name: name of the FMU.
        files: the files in the manifest.
        experiment: the experiment of the FMU, if it has one.
        shifted: whether the FMU forecasts its inputs within a step.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("slide_fmu.apps.credentials"),
        autoescape=True,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    page = members.REFERENCES_PAGE
    begin = 0.0
    if experiment is not None:
        begin = experiment.step * (experiment.steps + 1 - experiment.compared)
    text = environment.get_template("references.html").render(
        name=name,
        files=[(members.link(file.member, page), file) for file in files],
        manifest=members.link(members.MANIFEST, page),
        experiment=experiment,
        tolerance=OUTPUT_TOLERANCE,
        begin=begin,
        shifted=shifted,
    )
    return text.encode("utf-8")


def with_links(page: bytes) -> bytes:
    """Return the main page of an FMU with links to the others; a page with links stays unchanged.

    A page without an end of its body stays unchanged too: there is no place for the links.
    """
    text = page.decode("utf-8")
    if FOOTER in text or END not in text:
        return page
    addresses = {
        "model card": CARD,
        "related files and an experiment to repeat": members.REFERENCES_PAGE,
        "credentials (SRMD)": members.METADATA,
        "licences": f"{LICENSES}/license.txt",
    }
    links = ", ".join(
        f'<a href="{members.link(name, PAGE)}">{text}</a>' for text, name in addresses.items()
    )
    before, end, rest = text.rpartition(END)
    return f"{before}{FOOTER}\n<p>In this FMU: {links}.</p>\n{end}{rest}".encode()
