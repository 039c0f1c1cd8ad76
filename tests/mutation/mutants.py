"""Small faults in sources, one at a time: what a mutant is, and where C is mutated."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Mutant:
    """A source text with one fault.

    Attributes:
        line: where the fault is, from 1 on.
        fault: what was replaced by what, as people read it.
        text: the whole source with the fault.
    """

    line: int
    fault: str
    text: str


C_SWAPS = {
    "<": ["<="],
    "<=": ["<"],
    ">": [">="],
    ">=": [">"],
    "==": ["!="],
    "!=": ["=="],
    "&&": ["||"],
    "||": ["&&"],
    "+": ["-"],
    "-": ["+"],
    "*": ["/"],
    "/": ["*"],
    "%": ["/"],
    "+=": ["="],
    "0": ["1"],
    "1": ["0", "2"],
    "true": ["false"],
    "false": ["true"],
}
"""Tokens, and what each is replaced by. Binary operators stand between spaces in this code, so
that pointers, signs and increments are left alone."""

_C_TOKEN = re.compile(
    r"(?<= )(<=|>=|==|!=|&&|\|\||\+=|[<>+\-*/%])(?= )|(?<![\w.])(0|1|true|false)(?![\w.])"
)
_C_SKIPPED = re.compile(r"/\*.*?\*/|^[ \t]*#.*?$", re.DOTALL | re.MULTILINE)


def c_mutants(source: str) -> Iterator[Mutant]:
    """Mutants of a C source, in the order of the text; comments and directives are left alone."""
    skipped = [match.span() for match in _C_SKIPPED.finditer(source)]
    for match in _C_TOKEN.finditer(source):
        begin, end = match.span()
        if any(first <= begin < last for first, last in skipped):
            continue
        line = source.count("\n", 0, begin) + 1
        start = source.rfind("\n", 0, begin) + 1
        stop = source.find("\n", end)
        for other in C_SWAPS[match.group()]:
            fault = f"{source[start:begin]}[{match.group()} -> {other}]{source[end:stop]}".strip()
            yield Mutant(line, fault, source[:begin] + other + source[end:])
