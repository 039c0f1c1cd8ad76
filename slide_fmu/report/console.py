"""This module prints figures on a console, as lines and as tables that fit narrow terminals.

All functions print to the console that they are given.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text

from slide_fmu.fitting.history import Curve, SizeTrial
from slide_fmu.report.error_tables import noise_sentences
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.learning_tables import curve_table, size_table
from slide_fmu.report.row_tables import card_table
from slide_fmu.report.table import ENDLESS, ReportTable
from slide_fmu.report.tone_map import tone_table
from slide_fmu.report.verdict import verdict
from slide_fmu.surrogate.description import LABEL, SIGNAL_COLUMNS
from slide_fmu.validation.error_figures import OutputFigures
from slide_fmu.validation.row import Row

NOT_MEASURED = "was not measured yet: run slide-fmu validate FMU"
NOT_MEASURABLE = (
    "cannot be measured by slide-fmu: the FMU carries no recipe of a reference system. In Python, "
    "compare slide_fmu.simulate(FMU, t, u) with the outputs of your own model"
)
"""Where the error would stand: for an FMU with a recipe, and for one without."""


@final
class PrintedTable:
    """A PrintedTable has its rows one below the other where a table does not fit.

    Text is never cut, and a word is broken only where it is longer than the terminal is wide.
    """

    def __init__(self, table: ReportTable) -> None:
        self._table = table

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the table, or its rows one below the other."""
        heading, rows = self._table.heading, self._table.rows
        table = RichTable(*(Column(name, overflow="fold") for name in heading))
        for row in rows:
            table.add_row(*row)
        endless = options.update(width=ENDLESS)
        if Measurement.get(console, endless, table).minimum <= options.max_width:
            yield table
            return
        for row in rows:
            for k, (name, cell) in enumerate(zip(heading, row, strict=True)):
                if cell:
                    label = f"{name}: " if name else ""
                    yield Text(f"{'  ' if k else ''}{label}{cell}")


def print_table(table: ReportTable, console: Console) -> None:
    """Print the title of a table, if it has one, and the table.

    Rich would wrap a title of its own to the width of the table.
    """
    if table.title:
        console.print(table.title)
    console.print(PrintedTable(table))


def print_rows(rows: Sequence[Row], console: Console) -> None:
    """Print a row for each kind of input that was measured, and the verdict on them."""
    if rows:
        print_table(card_table(rows), console)
        tones = tone_table(rows)
        if tones.rows:
            print_table(tones, console)
        for sentence in verdict(rows):
            console.print(sentence)


def print_noise(outputs: Sequence[OutputFigures], console: Console) -> None:
    """Say how much of the errors on records is noise of what was measured, where it is known."""
    for sentence in noise_sentences(outputs):
        console.print(sentence)


def print_curve(curve: Curve | None, console: Console) -> None:
    """Print the learning curve by which numbers of trajectories were found, if there is one."""
    if curve is not None and curve.points:
        print_table(curve_table(curve), console)
        console.print(f"The learning curve ended: {curve.ended}.")


def print_sizes(
    sizes: tuple[SizeTrial, ...] | None, explanations: Sequence[str], console: Console
) -> None:
    """Print the sizes that a search has tried, if there was one, and why each choice pays."""
    if sizes:
        print_table(size_table(sizes), console)
    for sentence in explanations:
        console.print(f"{sentence}.")


def print_description(described: FmuDescription, console: Console) -> None:
    """Print an FMU: its measured error and verdict, its signals, its network, and its origin.

    Raises:
        ValueError: its provenance is not of the form that this version writes.
    """
    surrogate, origin, measured = described.surrogate, described.origin, described.measured
    # descriptions that init proposes begin with the name
    summary = origin.description.removeprefix(f"{surrogate.name}: ")
    console.print(f"{surrogate.name}: {summary}".rstrip(": "))
    if described.quick is not None:
        console.print(f"remark: {described.quick}")
    if measured is None:
        console.print(f"Its error {NOT_MEASURED if origin.recipe else NOT_MEASURABLE}.")
    else:
        print_rows(measured.rows, console)
        print_noise(measured.in_range.outputs, console)
    print_table(ReportTable.of(SIGNAL_COLUMNS, surrogate.signal_rows()), console)
    for label, text in (*surrogate.lines(), *_origin_lines(described)):
        console.print(f"{label:{LABEL}}{text}")


def _origin_lines(described: FmuDescription) -> list[tuple[str, str]]:
    """Return what is said of how an FMU was made, each with a label."""
    origin = described.origin
    if not described.provenance:
        return [("origin", "not known: the FMU has no provenance")]
    lines = len(origin.recipe.splitlines())
    return [
        ("seeds", ", ".join(f"{use} {seed}" for use, seed in origin.known_seeds.items())),
        ("made by", ", ".join(f"{name} {version}" for name, version in origin.versions.items())),
        ("recipe", f"{lines} lines; slide-fmu info FMU --json - shows them, and all figures"),
    ]
