"""Write the files generated from the table of variables: a C header and a page of the docs.

Run ``python -m slide_fmu.fmu.description.generate`` after a change of ``variables.py``; a test
compares both files with the table.
"""

from __future__ import annotations

from pathlib import Path

from slide_fmu.fmu.description.variables import KINDS, REFERENCES_PER_KIND, VariableKind

ROOT = Path(__file__).parents[3]
HEADER = Path(__file__).parents[1] / "runtime" / "calls" / "variable_kinds.h"
PAGE = ROOT / "docs" / "variables.md"
COMMAND = "python -m slide_fmu.fmu.description.generate"

PER = {
    "one": "",
    "input": "for each input",
    "output": "for each output",
    "parameter": "for each physical parameter",
}
WHEN = {
    "always": "",
    "estimator": "with an error estimate",
    "state_space": "with a state-space network",
    "several_samples": "where the network knows several samples of the outputs at a time",
    "first_order": "where inputs have a first-order hold",
    "parameters": "with physical parameters",
    "bound": "with an error bound",
    "output_ranges": "where the ranges of the outputs in the training are known",
}
SIZE = {
    "scalar": "",
    "block": "as many values as the network knows samples of the outputs",
    "sampled": "as many values as any result depends on samples of the inputs",
}


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
    """Write the page for users, as Markdown."""
    rows = "\n".join(map(_row, KINDS))
    return f"""\
# Variables of an FMU

Every FMU of slide-fmu has these variables, in FMI 2.0 and FMI 3.0 with the same
names and value references. A value reference is {REFERENCES_PER_KIND} times the
number of the kind of variable, plus the index among the variables of this kind,
which counts from 0. So it stays what it is when a surrogate gets more inputs, or
slide-fmu more kinds of variables.

A description of a signal in its recipe takes the place of the text below.

| variable | value references | causality, variability | type | there is one | description |
| --- | --- | --- | --- | --- | --- |
{rows}

This page is made by `{COMMAND}`.
"""


def _row(kind: VariableKind) -> str:
    """Write the row of a kind, as Markdown."""
    signal, index = f"<{kind.per}>", "" if kind.per == "one" else " + index"
    of_type = {"Real": "Real (Float64)", "Boolean": "Boolean"}[kind.type]
    conditions = [PER[kind.per], WHEN[kind.when], "in FMI 3.0" if kind.fmi == 3 else ""]
    text = kind.text.format(signal=f"`{signal}`", positions="n", size="n")
    if kind.text_fmi_3:
        text += f" In FMI 3.0: {kind.text_fmi_3}"
    cells = [
        f"`{kind.name_for(signal)}`",
        f"{kind.reference()}{index}",
        f"{kind.causality}, {kind.variability}",
        ", ".join(filter(None, [of_type, SIZE[kind.size]])),
        ", ".join(filter(None, conditions)) or "always",
        text,
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write both files, and print their names."""
    PAGE.parent.mkdir(exist_ok=True)
    for path, text in ((HEADER, header()), (PAGE, page())):
        path.write_text(text, encoding="utf-8")
        print(f"wrote {path}")


if __name__ == "__main__":
    main()
