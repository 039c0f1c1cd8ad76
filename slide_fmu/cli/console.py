"""What all verbs say and write: progress, errors, figures."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich import progress as rich_progress
from rich.console import Console

from slide_fmu.core.progress import Progress, Stages

TRACEBACK = "SLIDE_FMU_TRACEBACK"
"""Environment variable: if set, errors show where they come from."""

console = Console(stderr=True, markup=False, highlight=False)


def write_json(path: str | None, figures: Any) -> None:
    if path is None:
        return
    text = json.dumps(figures, indent=2, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
    else:
        Path(path).write_text(text, encoding="utf-8")


@contextmanager
def progress_bars() -> Iterator[Stages]:
    """Progress bars on a terminal, lines elsewhere; and errors as messages."""
    if not console.is_terminal:
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
    """Progress as a line for every tenth of the work."""
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
