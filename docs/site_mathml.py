r"""Formulas in TeX become MathML, which browsers show without any script.

Pages write them between dollars, as in ``$x^2$``. The package latex2mathml converts them.
"""

from __future__ import annotations

import re
from html import unescape

from latex2mathml.converter import convert

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
"""How the extension arithmatex leaves a formula in a page."""
FUNCTION = re.compile(r"<m([io])>(ln|lg|exp|tanh|max|min|Re)</m\1>")
SPACED = r'<mo form="prefix" lspace="0.17em" rspace="0.17em">\2</mo>'
"""The package leaves no space behind the name of a function."""


def with_formulas(html: str) -> str:
    """Return a page with MathML in the place of each formula."""
    return FORMULA.sub(_replaced, html)


def _replaced(match: re.Match[str]) -> str:
    formula = mathml(unescape(match[2]), block=match[1] == "div")
    return f'<div class="formula">{formula}</div>' if match[1] == "div" else formula


def mathml(tex: str, block: bool = False) -> str:
    """Return a formula as MathML; a ``ValueError`` names a command that is not known."""
    markup = convert(tex, display="block" if block else "inline")
    unknown = re.search(r"\\\w+", markup)
    if unknown is not None:
        raise ValueError(f"formula {tex!r}: latex2mathml does not know {unknown[0]}; correct it")
    return FUNCTION.sub(SPACED, markup.replace("&#x0211C;", "Re"))
