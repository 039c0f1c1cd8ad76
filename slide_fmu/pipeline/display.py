"""Progress as people see it: bars on a terminal, lines in a pipe, a file or a notebook."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich import progress as rich_progress
from rich.console import Console, ConsoleDimensions

from slide_fmu.core.progress import Progress, Stages

ENDLESS = 1_000_000
"""Columns of a pipe or a file: more than any message or table has."""


class Messages(Console):
    """A console that wraps and cuts lines on a terminal only.

    Rich takes the width of a pipe from COLUMNS, or 80 columns; who reads a pipe looks for whole
    sentences, whatever the width of some terminal is.
    """

    @property
    def size(self) -> ConsoleDimensions:
        """Columns and rows: those of the terminal, or no end of columns elsewhere."""
        size = super().size
        return size if self.file.isatty() else ConsoleDimensions(ENDLESS, size.height)

    @size.setter
    def size(self, new_size: tuple[int, int]) -> None:
        self._width, self._height = new_size


def messages() -> Messages:
    """Open the console of people: standard error, as it is now."""
    return Messages(stderr=True, markup=False, highlight=False)


@contextmanager
def shown(console: Console) -> Iterator[Stages]:
    """Show the progress of stages as bars on a terminal, as lines elsewhere."""
    if not console.file.isatty():  # not is_terminal, which FORCE_COLOR makes true for a pipe
        yield lambda stage: _lines(console, stage)
        return
    columns = (
        rich_progress.TextColumn("{task.description:>24}"),
        rich_progress.BarColumn(),
        rich_progress.MofNCompleteColumn(),
        rich_progress.TimeRemainingColumn(),
        rich_progress.TextColumn("{task.fields[remark]}"),
    )
    with rich_progress.Progress(*columns, console=console) as bars:

        def bar(stage: str) -> Progress:
            task, first = bars.add_task(stage, total=None, remark=""), None

            def progress(done: int, total: int, error: float | None = None) -> None:
                nonlocal first
                first = total if first is None else first
                remark = f"{_grown(total, first)}  {_remark(error)}".strip()
                bars.update(task, completed=done, total=total, remark=remark)

            return progress

        yield bar


def _lines(console: Console, stage: str) -> Progress:
    """Show progress as a line for every tenth of the work, which may turn out to be more."""
    printed, first = -1, None

    def progress(done: int, total: int, error: float | None = None) -> None:
        nonlocal printed, first
        first = total if first is None else first
        tenth = 10 * done // max(1, total)
        if tenth != printed:
            printed = tenth
            counted = f"{done} of {total} {_grown(total, first)}".rstrip()
            console.print(f"{stage}: {counted}  {_remark(error)}".rstrip())

    return progress


def _grown(total: int, first: int) -> str:
    """Say that a search has found more work than it began with, and may find yet more."""
    return "so far" if total > first else ""


def _remark(error: float | None) -> str:
    return "" if error is None else f"validation error {error:.3g}"
