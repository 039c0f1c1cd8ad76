"""This module shows progress: bars on a terminal, lines in a pipe, a file or a notebook."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import final

from rich import progress as rich_progress
from rich.console import Console, ConsoleDimensions, RenderableType
from rich.table import Column
from rich.text import Text

from slide_fmu.core.progress import Progress, Stages
from slide_fmu.report.table import ENDLESS

WIDE = 90
"""Columns of a terminal from which on bars are drawn and errors named."""
SOON = 10.0
"""A pipe shows how long a stage takes after this time in s, or after its first part."""
PARTS, APART = 5, 1.0
"""A pipe has a line for each of this number of parts of a stage, and time in s between two
lines."""


class Messages(Console):
    """A console that wraps and cuts lines on a terminal only.

    Rich takes the width of a pipe from COLUMNS, or 80 columns; who reads a pipe looks for whole
    sentences, whatever the width of some terminal is.
    """

    @property
    def size(self) -> ConsoleDimensions:
        """Columns and rows of the terminal; elsewhere the number of columns is ``ENDLESS``."""
        size = super().size
        return size if self.file.isatty() else ConsoleDimensions(ENDLESS, size.height)

    @size.setter
    def size(self, new_size: tuple[int, int]) -> None:
        self._width, self._height = new_size


def messages() -> Messages:
    """Open the console of people: standard error, as it is now."""
    return Messages(stderr=True, markup=False, highlight=False)


@contextmanager
def progress_on(console: Console) -> Iterator[Stages]:
    """Show the progress of stages as bars on a terminal, as lines elsewhere."""
    if not console.file.isatty():  # not is_terminal, which FORCE_COLOR makes true for a pipe
        yield lambda stage: _Lines(console, stage)
        return
    wide = console.width >= WIDE
    columns = (
        # names go on in a second row where there is no place, since nothing else can be shortened
        rich_progress.TextColumn("{task.description}", table_column=Column()),
        *((rich_progress.BarColumn(20),) if wide else ()),
        rich_progress.TextColumn("{task.fields[counted]}"),
        _Time(table_column=Column(no_wrap=True)),
        rich_progress.TextColumn("{task.fields[remark]}"),
    )
    with _Bars(*columns, console=console) as bars:
        yield _TerminalStages(bars, wide)


@final
@dataclass
class _TerminalStages:
    """The stages on a terminal, with a line for all of them below."""

    bars: _Bars
    wide: bool

    def __call__(self, name: str) -> Progress:
        """Open the progress of a stage."""
        return _Bar(self.bars, name, self.wide)

    def show_whole(self, text: str) -> None:
        """Show a text below the stages."""
        self.bars.whole = text


@final
class _Bars(rich_progress.Progress):
    """The bars of all stages, of which the newest are shown while not all have a place.

    Attributes:
        whole: a line about all of them, below; empty while there is nothing to say.
    """

    whole: str = ""

    def get_renderables(self) -> Iterable[RenderableType]:
        """Show as many stages as the terminal has rows for; after the work show all of them."""
        if not self.tasks:  # as in the constructor, where there is no console yet
            yield self.make_tasks_table([])
            return
        rows = max(2, self.console.height - 2)
        most = rows if self.console.width >= WIDE else rows // 2  # names may take two rows
        ended = self.live.vertical_overflow == "visible"  # of the display that rich leaves behind
        yield self.make_tasks_table(self.tasks if ended else self.tasks[-most:])
        if self.whole and not ended:
            yield Text(self.whole, overflow="ellipsis", no_wrap=True)


@final
class _Time(rich_progress.ProgressColumn):
    """The time that is left, or that a finished stage took."""

    def render(self, task: rich_progress.Task) -> Text:
        """Write the time of a stage; the text is empty before a part of it is done."""
        if task.finished:
            return Text(f"took {_duration(task.finished_time or 0.0)}")
        left = task.time_remaining
        return Text("" if left is None else _left(left, bool(task.fields.get("at_most"))))


@final
@dataclass
class _Bar:
    """A bar of a stage; each of its parts has a bar of its own."""

    bars: rich_progress.Progress
    name: str
    wide: bool
    at_most: bool = False
    task: rich_progress.TaskID | None = None

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Show how far the work is."""
        if self.task is None:
            self.task = self.bars.add_task(
                self.name, total=None, counted="", remark="", at_most=self.at_most
            )
        counted = f"{done} of {_total(done, total, self.at_most)}"
        remark = _remark(error) if self.wide else _percent(error)
        self.bars.update(self.task, completed=done, total=total, counted=counted, remark=remark)

    def part(self, name: str, at_most: bool) -> Progress:
        """Open a part of the stage."""
        return _Bar(self.bars, _part_name(self.name, name), self.wide, at_most)


@final
@dataclass
class _Lines:
    """A line for every fifth of a stage, and one as soon as its time can be estimated.

    A stage that takes less than ``APART`` has a line at its start and one at its end. Work that
    goes on from where it was stopped, and may end early, has its first line after its first part:
    often nothing is left of it, and the line at its end says so.
    """

    console: Console
    name: str
    at_most: bool = False
    printed: int = -1
    when: float = -math.inf
    estimated: bool = False
    begin: tuple[float, int] | None = None

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Show how far the work is."""
        now = time.monotonic()
        if self.begin is None:
            self.begin = now, done
            if self.at_most and 0 < done < total:
                return
        part = PARTS * done // max(1, total)
        if part < self.printed:  # there is more work than was planned
            self.printed = -1
        early = not self.estimated and done > self.begin[1] and now - self.begin[0] > SOON
        soon = now - self.when < APART and done < total
        if (part == self.printed or soon) and not early:
            return
        self.printed, self.when = part, now
        time_left = self._time(now, done, total)
        self.estimated = self.estimated or bool(time_left)
        counted = f"{done} of {_total(done, total, self.at_most)}"
        parts = (counted, time_left, _remark(error))
        self.console.print(f"{self.name}: {', '.join(part for part in parts if part)}")

    def _time(self, now: float, done: int, total: int) -> str:
        """Estimate the time left from the time passed; at the end give the time of all."""
        assert self.begin is not None
        passed, made = now - self.begin[0], done - self.begin[1]
        if made <= 0:
            return ""
        if done >= total:
            return f"took {_duration(passed)}"
        return _left(passed / made * (total - done), self.at_most)

    def part(self, name: str, at_most: bool) -> Progress:
        """Open a part of the stage."""
        return _Lines(self.console, _part_name(self.name, name), at_most)


def _part_name(stage: str, part: str) -> str:
    return f"{stage}, {part}" if part else stage


def _total(done: int, total: int, at_most: bool) -> str:
    """Write the amount of work, with "at most" where a stage may end early."""
    return f"at most {total}" if at_most and done < total else str(total)


def _left(seconds: float, at_most: bool) -> str:
    """Write the time that is left; of work that may end early it is the most that may be."""
    return f"{'at most ' if at_most else ''}{_duration(seconds)} left"


def _duration(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def _percent(error: float | None) -> str:
    """Write a relative RMSE; the text is empty where it is unknown."""
    known = error is not None and math.isfinite(error)
    return f"{100 * error:.3g} %" if known and error is not None else ""


def _remark(error: float | None) -> str:
    percent = _percent(error)
    return f"validation error {percent}" if percent else ""
