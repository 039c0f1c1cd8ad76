r"""Formulas in TeX become MathML, which browsers show without any script.

Pages write them between dollars, as in ``$x^2$``. A small part of TeX is known: ``FUNCTIONS``,
``SYMBOLS``, groups, indices, ``\frac``, ``\sqrt``, ``\text`` and ``ACCENTS``. Anything else is an
error.
"""

from __future__ import annotations

import re
from html import escape, unescape

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
"""How the extension arithmatex leaves a formula in a page."""
TOKEN = re.compile(r"\\text\{[^}]*\}|\\[A-Za-z]+|\\.|[0-9]+(?:\.[0-9]+)?|\S")
FUNCTIONS = {f"\\{name}" for name in ("max", "min", "ln", "lg", "exp", "tanh", "Re")}
SYMBOLS = {r"\alpha": "\u03b1", r"\varepsilon": "ε", r"\lambda": "λ", r"\tau": "τ"}
SYMBOLS |= {r"\varphi": "φ", r"\nu": "\u03bd"}
SYMBOLS |= {r"\le": "≤", r"\ge": "≥", r"\cdot": "⋅", r"\sum": "∑", r"\dots": "…", "-": "\u2212"}
SPACES = {r"\quad": "1em", r"\,": "0.17em"}
ACCENTS = {r"\dot": "˙", r"\ddot": "¨", r"\hat": "^", r"\bar": "¯"}


def with_formulas(html: str) -> str:
    """Return a page with MathML in the place of each formula."""
    return FORMULA.sub(_replaced, html)


def _replaced(found: re.Match[str]) -> str:
    formula = mathml(unescape(found[2]), block=found[1] == "div")
    return f'<div class="formula">{formula}</div>' if found[1] == "div" else formula


def mathml(tex: str, block: bool = False) -> str:
    """Return a formula as MathML; ``ValueError`` names a command that is not known."""
    display = "block" if block else "inline"
    return f'<math display="{display}">{_row(TOKEN.findall(tex)[::-1])}</math>'


def _row(tokens: list[str]) -> str:
    """Take tokens up to a closing brace or the end."""
    row = ""
    while tokens and tokens[-1] != "}":
        base, marks = _atom(tokens), {"_": "", "^": ""}
        while tokens and tokens[-1] in marks:
            mark = tokens.pop()
            marks[mark] = _atom(tokens)
        tag = "m" + "".join(name for name, at in (("sub", "_"), ("sup", "^")) if marks[at])
        inner = base + marks["_"] + marks["^"]
        row += inner if tag == "m" else f"<{tag}>{inner}</{tag}>"
    return f"<mrow>{row}</mrow>"


def _atom(tokens: list[str]) -> str:
    """Take one group, command, number, letter or sign."""
    token = tokens.pop()
    if token == "{":
        group = _row(tokens)
        tokens.pop()
        return group
    if token.startswith(r"\text"):
        return f"<mtext>{escape(token[6:-1])}</mtext>"
    if token == r"\frac":
        return f"<mfrac>{_atom(tokens)}{_atom(tokens)}</mfrac>"
    if token == r"\sqrt":
        return f"<msqrt>{_atom(tokens)}</msqrt>"
    if token in ACCENTS:
        return f'<mover accent="true">{_atom(tokens)}<mo>{ACCENTS[token]}</mo></mover>'
    if token in SPACES:
        return f'<mspace width="{SPACES[token]}"/>'
    if token in FUNCTIONS:
        return f'<mo form="prefix" lspace="0.17em" rspace="0.17em">{token[1:]}</mo>'
    if token in "()":
        return f'<mo stretchy="false">{token}</mo>'
    if token.startswith("\\") and token not in SYMBOLS:
        raise ValueError(f"docs/site_mathml.py does not know {token}: add it to SYMBOLS")
    text = SYMBOLS.get(token, token)
    tag = "mn" if text[0].isdigit() else "mi" if text.isalpha() else "mo"
    return f"<{tag}>{escape(text)}</{tag}>"
