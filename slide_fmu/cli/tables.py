"""Tables of subcommands, which stay readable where a terminal is narrow."""

from __future__ import annotations

from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

from slide_fmu.pipeline.display import ENDLESS


class Rows:
    """Rows are printed as a table, or one below the other where the words of a table do not fit.

    Text is never cut, and a word is broken only where it is longer than the terminal is wide.
    Final.
    """

    def __init__(self, headings: tuple[str, ...]) -> None:
        self._headings, self._rows = list(headings), list[tuple[str, ...]]()

    def add_column(self, heading: str) -> None:
        """Add a column behind the others."""
        self._headings.append(heading)

    def add_row(self, *cells: str) -> None:
        """Add a row with a cell for each column; cells at its end may be left out."""
        self._rows.append(cells)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the table, or its rows one below the other."""
        table = Table(*(Column(heading, overflow="fold") for heading in self._headings))
        for row in self._rows:
            table.add_row(*row)
        endless = options.update(width=ENDLESS)
        if Measurement.get(console, endless, table).minimum <= options.max_width:
            yield table
            return
        for row in self._rows:
            for k, (heading, cell) in enumerate(zip(self._headings, row, strict=False)):
                if cell:
                    label = f"{heading}: " if heading else ""
                    yield Text(f"{'  ' if k else ''}{label}{cell}")


def table_of(*headings: str) -> Rows:
    """Open a table with these columns."""
    return Rows(headings)
