"""The model card describes a released FMU on one screen: verdict, picture and table of errors.

All else stands in the report, which the FMU carries too.
"""

from __future__ import annotations

import html

import jinja2

from slide_fmu.core.readable import decimal
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.error_tables import noise_sentences
from slide_fmu.report.limits import useless_beyond
from slide_fmu.report.row_tables import HELD, RULE, WORDS, kind_table
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.speed import timing_text
from slide_fmu.report.table import ReportTable, markdown
from slide_fmu.report.verdict import verdict
from slide_fmu.surrogate.surrogate import Surrogate


def model_card(
    surrogate: Surrogate,
    recipe: Recipe,
    measured: RunFigures,
    picture: str | None,
    mechanism: str | None = None,
) -> str:
    """Write the model card as Markdown.

    Args:
        surrogate: the surrogate that the FMU runs.
        recipe: the recipe that it was made from.
        measured: the figures of the report.
        picture: file name of the picture "error against communication step" in the folder of the
            card; None where that was not measured.
        mechanism: file name of a picture of the system, in the same folder; None without one.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("slide_fmu.report"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["markdown"] = markdown
    environment.filters["decimal"] = decimal
    environment.filters["plain"] = plain
    judged = any(row.valid is not None for row in measured.rows)
    return environment.get_template("card.md").render(
        surrogate=surrogate,
        recipe=recipe,
        measured=measured,
        verdict=verdict(measured.rows),
        table=_plain_table(kind_table(measured.rows)),
        words=" ".join(
            [
                *([HELD] if surrogate.hold == "zero_order" else []),
                WORDS,
                *([RULE] if judged else []),
            ]
        ),
        timing=timing_text(measured.in_range.timing),
        useless=useless_beyond(measured),
        remarks=[*noise_sentences(measured.in_range.outputs), *(measured.record_remarks or ())],
        picture=picture,
        mechanism=mechanism,
    )


def plain(text: str) -> str:
    """Return a user's text as one line that Markdown shows as it is, in tables too."""
    return " ".join(html.escape(text, quote=False).replace("|", "\\|").split())


def _plain_table(table: ReportTable) -> ReportTable:
    """Return a table whose cells Markdown shows as they are."""
    return ReportTable.of(table.heading, (map(plain, row) for row in table.rows), table.title)


def without_pictures(card: str) -> str:
    """Return a model card without pictures, which are separate files; the report shows them."""
    lines = card.split("\n")
    return "\n".join(line for line in lines if not line.startswith("!["))
