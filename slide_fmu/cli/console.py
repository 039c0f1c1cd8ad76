"""All subcommands say and write alike: progress, errors, figures, tables."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich import progress as rich_progress
from rich.console import Console, ConsoleDimensions
from rich.table import Table

from slide_fmu.core.progress import Progress, Stages

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
    """Write figures as JSON to a path, to standard output for ``-``, or nowhere for None."""
    if path is None:
        return
    text = json.dumps(figures, indent=2, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
    else:
        Path(path).write_text(text, encoding="utf-8")


def show_json(path: str | None, figures: Any) -> None:
    """Write figures as ``write_json`` does, and print them unless they go to stdout by that."""
    write_json(path, figures)
    if path != "-":
        Console().print_json(json.dumps(figures))


def show_validation(figures: dict[str, Any], title: str) -> None:
    """Print the accuracy of every output, in its unit, and of the error estimate."""
    # not as the table's title, which rich wraps to the width of the table
    console.print(f"{title}: {figures['trajectories']} trajectories, seed {figures['seed']}")
    table = Table("output", "RMS of the reference", "RMSE", "relative RMSE", "largest error")
    for output in figures["outputs"]:
        unit = output["unit"]
        table.add_row(
            output["name"],
            f"{output['rms_reference']:.4g} {unit}",
            f"{output['rmse']:.4g} {unit}",
            f"{100 * output['relative_rmse']:.3g} %",
            f"{output['max_error']:.4g} {unit}",
        )
    console.print(table)
    estimate = figures["error_estimate"]
    if estimate is not None:
        console.print(
            f"error estimate: mean relative deviation "
            f"{100 * estimate['mean_relative_deviation']:.3g} %, 95 % within "
            f"{100 * estimate['p95_relative_deviation']:.3g} %",
        )


def show_remark(remark: str | None) -> None:
    """Print what the user should know about a result, if there is anything."""
    if remark is not None:
        console.print(f"remark: {remark}", style="yellow")


@contextmanager
def progress_bars() -> Iterator[Stages]:
    """Show progress as bars on a terminal, as lines elsewhere; errors become messages."""
    if not console.file.isatty():  # not is_terminal, which FORCE_COLOR makes true for a pipe
        with errors():
            yield _lines
        return
    columns = (
        rich_progress.TextColumn("{task.description:>24}"),
        rich_progress.BarColumn(),
        rich_progress.MofNCompleteColumn(),
        rich_progress.TimeRemainingColumn(),
        rich_progress.TextColumn("{task.fields[remark]}"),
    )
    with errors(), rich_progress.Progress(*columns, console=console) as bars:

        def bar(stage: str) -> Progress:
            task = bars.add_task(stage, total=None, remark="")

            def progress(done: int, total: int, error: float | None = None) -> None:
                bars.update(task, completed=done, total=total, remark=_remark(error))

            return progress

        yield bar


def _lines(stage: str) -> Progress:
    """Show progress as a line for every tenth of the work."""
    printed = -1

    def progress(done: int, total: int, error: float | None = None) -> None:
        nonlocal printed
        tenth = 10 * done // max(1, total)
        if tenth > printed:
            printed = tenth
            console.print(f"{stage}: {done} of {total}  {_remark(error)}".rstrip())

    return progress


def _remark(error: float | None) -> str:
    return "" if error is None else f"validation error {error:.3g}"


@contextmanager
def errors() -> Iterator[None]:
    """Turn a user's mistakes into one message and exit code 1."""
    try:
        yield
    except ImportError as error:
        _fail(
            error, f"{error}; this subcommand needs more packages: pip install 'slide-fmu[train]'"
        )
    except (ValueError, RuntimeError, OSError) as error:
        _fail(error, str(error))
    except MemoryError as error:
        _fail(error, f"not enough memory: {error or 'nothing is left'}")


def _fail(error: Exception, message: str) -> None:
    if os.environ.get(TRACEBACK):
        raise error
    console.print(f"error: {message}", style="red")
    raise SystemExit(1) from None
