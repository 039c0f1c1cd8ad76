"""What all verbs say and write: progress, errors, figures."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console, ConsoleDimensions
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from slide_fmu.core.progress import Advance, Bar

TRACEBACK = "SLIDE_FMU_TRACEBACK"
"""Environment variable: if set, errors show where they come from."""

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


console = Messages(stderr=True, markup=False, highlight=False)


def write_json(path: str | None, figures: Any) -> None:
    if path is None:
        return
    text = json.dumps(figures, indent=2, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
    else:
        Path(path).write_text(text, encoding="utf-8")


@contextmanager
def progress_bars() -> Iterator[Bar]:
    """Progress bars on a terminal, lines elsewhere; and errors as messages."""
    if not console.file.isatty():  # not is_terminal, which FORCE_COLOR makes true for a pipe
        with errors():
            yield _lines
        return
    columns = (
        TextColumn("{task.description:>24}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[remark]}"),
    )
    with errors(), Progress(*columns, console=console) as progress:

        def bar(stage: str) -> Advance:
            task = progress.add_task(stage, total=None, remark="")

            def advance(done: int, total: int, remark: str) -> None:
                progress.update(task, completed=done, total=total, remark=remark)

            return advance

        yield bar


def _lines(stage: str) -> Advance:
    """Progress as a line for every tenth of the work."""
    printed = -1

    def advance(done: int, total: int, remark: str) -> None:
        nonlocal printed
        tenth = 10 * done // max(1, total)
        if tenth > printed:
            printed = tenth
            console.print(f"{stage}: {done} of {total}  {remark}".rstrip())

    return advance


@contextmanager
def errors() -> Iterator[None]:
    """Turn a user's mistakes into one message and exit code 1."""
    try:
        yield
    except ImportError as error:
        _fail(error, f"{error}; this verb needs more packages: pip install 'slide-fmu[train]'")
    except (ValueError, RuntimeError, OSError) as error:
        _fail(error, str(error))
    except MemoryError as error:
        _fail(error, f"not enough memory: {error or 'nothing is left'}")


def _fail(error: Exception, message: str) -> None:
    if os.environ.get(TRACEBACK):
        raise error
    console.print(f"error: {message}", style="red")
    raise SystemExit(1) from None
