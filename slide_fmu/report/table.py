"""A Table holds figures as texts; console, Markdown and HTML show it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

ENDLESS = 1_000_000
"""Number of columns of a pipe or a file, wider than any message or table."""


@dataclass(frozen=True)
class ReportTable:
    """A ReportTable has a heading, and rows with a text for each column.

    Attributes:
        heading: names of the columns.
        rows: the cells of each row.
        title: heading above the table where it is printed by itself.
    """

    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""

    @classmethod
    def of(
        cls, heading: Iterable[str], rows: Iterable[Iterable[str]], title: str = ""
    ) -> ReportTable:
        """Return the table with a heading and rows of any sequence type."""
        return cls(tuple(heading), tuple(tuple(row) for row in rows), title)

    def without_empty_columns(self) -> ReportTable:
        """Return the table without columns in which no row has a text."""
        filled = [any(row[k] for row in self.rows) for k in range(len(self.heading))]
        return self._of_columns([k for k, some in enumerate(filled) if some])

    def columns(self, *names: str) -> ReportTable:
        """Return the table of the columns with these names, as far as it has them."""
        known = [self.heading.index(name) for name in names if name in self.heading]
        return self._of_columns(known)

    def _of_columns(self, places: Sequence[int]) -> ReportTable:
        rows = ([row[k] for k in places] for row in self.rows)
        return ReportTable.of((self.heading[k] for k in places), rows, self.title)


def markdown(table: ReportTable) -> str:
    """Return a table as Markdown, one line for the heading, one below it, and one per row."""
    heading = "".join(f" {name} |" if name else " |" for name in table.heading)
    rows = (f"| {' | '.join(row)} |" for row in table.rows)
    return "\n".join([f"|{heading}", f"|{' --- |' * len(table.heading)}", *rows])
