"""Write what is generated from the table of variables: a C header, and a table of the docs.

Run ``python -m slide_fmu.fmu.description.generate`` after a change of ``variables.py``; a test
compares both files with the table.
"""

from __future__ import annotations

from pathlib import Path

from slide_fmu.fmu.description.variables import KINDS, REFERENCES_PER_KIND, VariableKind

ROOT = Path(__file__).parents[3]
HEADER = Path(__file__).parents[1] / "runtime" / "calls" / "variable_kinds.h"
PAGE = ROOT / "docs" / "variables.md"
WORDS = "\n## Words\n"
"""The page is written by hand from this heading on."""
COMMAND = "python -m slide_fmu.fmu.description.generate"

WHEN = {
    "always": "always",
    "estimator": "error estimate",
    "state_space": "state-space network",
    "several_samples": "several samples at a time",
    "first_order": "moving inputs",
    "zero_order": "held inputs",
    "parameters": "physical parameters",
    "bound": "error bound",
    "output_ranges": "known ranges",
    "known_start": "state-space network, no physical parameters",
}
"""What an FMU must have for the variable to exist, in the page's table."""


def header() -> str:
    """Write the C header: a macro with all kinds, which ``runtime/calls/variables.c`` expands."""
    rows = [
        f"    KIND({kind.key}, {kind.number}, {kind.causality.upper()}, {kind.type.upper()}, "
        f"{kind.per.upper()}, {kind.when.upper()}, {kind.size.upper()}, {kind.fmi})"
        for kind in KINDS
    ]
    continued = " \\\n"
    return f"""\
/* All kinds of variables, as slide_fmu/fmu/description/variables.py lists them.
 * Made by {COMMAND}; do not edit. */
#ifndef SLIDE_VARIABLE_KINDS_H
#define SLIDE_VARIABLE_KINDS_H

/* A value reference is the number of a kind times this plus an index. */
enum {{ SLIDE_REFERENCES_PER_KIND = {REFERENCES_PER_KIND} }};

/* KIND(name, number, causality, type, one for each of what, what the surrogate must
 * have, number of values, first version of FMI) */
#define SLIDE_VARIABLE_KINDS(KIND){continued.join(["", *rows])}

#endif
"""


def page() -> str:
    """Write the page for users, as Markdown; the words below the table stay as they are.

    Raises:
        ValueError: the page has lost the heading of the words.
    """
    rows = "\n".join(map(_row, KINDS))
    _, heading, words = PAGE.read_text("utf-8").partition(WORDS)
    if not heading:
        raise ValueError(f"{PAGE} has no heading {WORDS.strip()!r}: write it above the glossary")
    return f"""\
---
hide:
  - toc
---

# Variables and words

The variables are followed by a [glossary](#words).

## Variables of an FMU

All FMUs of slide-fmu use these names and value references, in FMI 2.0 and in FMI 3.0. References
never change: {REFERENCES_PER_KIND} times the kind, plus the index *i* of the signal from 0.

Reals are Float64 in FMI 3.0. Variables with *r* cost time only when they are read. A recipe's
description of a signal replaces ours in the FMU.

| variable | meaning | exists with | value reference | causality, variability | type |
| --- | --- | --- | --- | --- | --- |
{rows}

[Use an FMU](use_an_fmu.md) shows the main ones, and [trust](trust.md) the error bound.
{heading}{words}"""


def _row(kind: VariableKind) -> str:
    """Write the row of a kind, as Markdown."""
    signal, index = f"<{kind.per}>", "" if kind.per == "one" else " + i"
    array = "" if kind.size == "scalar" else " array"
    standard = ", FMI 3.0" if kind.fmi == 3 else ""
    read = " *r*" if "when it is read" in kind.text or "when they are read" in kind.text else ""
    cells = [
        f"`{kind.name_for(signal)}`{read}",
        kind.meaning,
        f"{WHEN[kind.when]}{standard}",
        f"{kind.reference()}{index}",
        f"{kind.causality}, {kind.variability}",
        f"{kind.type}{array}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write both files, and print their names."""
    for path, text in ((HEADER, header()), (PAGE, page())):
        path.write_text(text, encoding="utf-8")
        print(f"wrote {path}")


if __name__ == "__main__":
    main()
