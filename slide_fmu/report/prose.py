"""Prose on FMUs stands in templates; this module fills them with figures."""

from __future__ import annotations

import html
import re
from functools import cache

import jinja2

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, ratio_text
from slide_fmu.report.row_tables import length_of, name_of
from slide_fmu.report.table import markdown


def rendered(template: str, **values: object) -> str:
    """Return a template of this room as text, filled with values."""
    return _environment().get_template(template).render(**values)


def sentences(template: str, **values: object) -> list[str]:
    """Return the paragraphs of a template, filled with values, each as one line.

    A paragraph of a template is a sentence or a few that belong together; a blank line ends it.
    """
    paragraphs = re.split(r"\n\s*\n", rendered(template, **values))
    lines = (" ".join(paragraph.split()) for paragraph in paragraphs)
    return [line for line in lines if line]


def plain(text: str) -> str:
    """Return a user's text as one line that Markdown shows as it is, in tables too."""
    return " ".join(html.escape(text, quote=False).replace("|", "\\|").split())


def capitalised(text: str) -> str:
    """Return a text that begins a sentence."""
    return text[:1].upper() + text[1:]


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("slide_fmu.report"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {
        "capitalised": capitalised,
        "decimal": decimal,
        "markdown": markdown,
        "name_of": name_of,
        "percent": percent,
        "plain": plain,
        "ratio": ratio_text,
        "step_length": length_of,
    }
    return environment
