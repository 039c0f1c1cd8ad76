"""This module prints figures on a console, as lines and as tables that fit narrow terminals.

All functions print to the console that they are given.
"""

from __future__ import annotations

from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text

from slide_fmu.core.measures import percent
from slide_fmu.fitting.history import Curve, TriedSize
from slide_fmu.report.error_tables import box_table, plain_call_table, short_accuracy_table
from slide_fmu.report.learning_tables import curve_table, size_table
from slide_fmu.report.table import ENDLESS, ReportTable
from slide_fmu.report.trust_sentences import covered_sentence
from slide_fmu.report.trust_tables import (
    short_bound_table,
    short_estimate_table,
    tolerance_table,
)
from slide_fmu.validation.error_figures import (
    BoxFigures,
    OutputFigures,
    PlainCallFigures,
    ValidationFigures,
)
from slide_fmu.validation.trust import HARMFUL
from slide_fmu.validation.trust_figures import BoundFigures


class Rows:
    """Rows are printed as a table, or one below the other where a table does not fit.

    Text is never cut, and a word is broken only where it is longer than the terminal is wide.
    Final.
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
    console.print(Rows(table))


def print_plain_call(found: PlainCallFigures | None, console: Console) -> None:
    """Print the errors of the plain call of the FMU, where they were measured."""
    if found is not None:
        print_table(plain_call_table(found), console)
        console.print(found.sentence)


def print_box(found: BoxFigures | None, console: Console) -> None:
    """Print the errors of the FMU at constant inputs, where they were measured."""
    if found is not None:
        print_table(box_table(found), console)


def print_validation(figures: ValidationFigures, title: str, console: Console) -> None:
    """Print the accuracy of every output, in its unit, of the error estimate and of the bound.

    Where inputs move, the error of a plain importer call is given too.
    """
    console.print(f"{title}: {figures.trajectories} trajectories, seed {figures.seed}")
    print_table(short_accuracy_table(figures), console)
    for output in figures.outputs:
        if output.relative_noise_floor is not None:
            console.print(_noise(output, output.relative_noise_floor))
    if figures.error_estimate is not None:
        estimates = short_estimate_table(figures.error_estimate)
        if estimates.rows:
            print_table(estimates, console)
        else:
            console.print("error estimate: nothing is known of its deviation from the true error")
    if figures.error_bound is not None:
        _print_bound(figures.error_bound, console)
        tolerances = tolerance_table({title: figures})
        if tolerances.rows:
            print_table(tolerances, console)


def _print_bound(bound: BoundFigures, console: Console) -> None:
    """Print what error bounds cover, how wide they are, and how often the domain is left."""
    print_table(short_bound_table(bound), console)
    console.print(
        f"outside of the domain: {percent(bound.flagged)} of the samples, "
        f"{percent(bound.trajectories_flagged)} of the trajectories"
    )
    console.print(f"trusted is false: {percent(bound.untrusted)} of the samples")
    covered = covered_sentence(bound)
    if covered is not None:
        console.print(covered)
    if bound.harm is not None:
        console.print(
            f"harmful errors (more than {HARMFUL:g} times what is usual in range): "
            f"{percent(bound.harm.harmful)} of the samples; trusted and above the bound "
            f"{percent(bound.harm.harmful_unnoticed)}"
        )


def _noise(output: OutputFigures, floor: float) -> str:
    """Say how much of an error on a record is noise, and how much comes from the window."""
    noise = f"{output.name}: {percent(floor)} is noise"
    if output.free_relative_rmse is None:
        return noise
    return f"{noise}; free of the window the error is {percent(output.free_relative_rmse)}"


def print_curve(curve: Curve | None, console: Console) -> None:
    """Print the learning curve by which numbers of trajectories were found, if there is one."""
    if curve is not None and curve.points:
        print_table(curve_table(curve), console)
        console.print(f"it ended: {curve.ended}")


def print_sizes(sizes: tuple[TriedSize, ...] | None, console: Console) -> None:
    """Print the sizes that a search has tried, if there was one."""
    if sizes:
        print_table(size_table(sizes), console)
