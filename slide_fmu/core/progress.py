"""Long work reports its progress through one protocol, whoever displays it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, final, runtime_checkable


class Progress(Protocol):
    """A Progress shows how far one stage of the work is. Interface; any such function is one."""

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Show how far the work is: called at its start, and after each part of it.

        Args:
            done: parts of the work that are done.
            total: number of parts in all. Work that may end early names its part of a stage with
                ``part_of``, and ends with ``done = total``.
            error: the smallest validation error so far as relative RMSE, for work that minimizes
                it; None or infinite while none is known.
        """


@runtime_checkable
class Divisible(Progress, Protocol):
    """A Divisible is a progress whose stage may have parts with totals of their own. Interface."""

    def part(self, name: str, at_most: bool) -> Progress:
        """Open a part of the stage.

        Args:
            name: what the part does; empty for the stage itself.
            at_most: whether the total is only an upper limit.
        """


Stages = Callable[[str], Progress]
"""Opens the progress of a named stage."""


@runtime_checkable
class ShowsWhole(Protocol):
    """A ShowsWhole opens stages, and has a line for all of them together. Interface."""

    def show_whole(self, text: str) -> None:
        """Show a text in the place of the last one."""


def show_whole(stages: Stages, text: str) -> bool:
    """Show a text about all stages if there is a line for it; False if there is none."""
    if not isinstance(stages, ShowsWhole):
        return False
    stages.show_whole(text)
    return True


def quiet(done: int, total: int, error: float | None = None) -> None:
    """Show no progress."""


def part_of(progress: Progress, name: str = "", at_most: bool = False) -> Progress:
    """Open a part of a stage if its progress knows parts; otherwise return the progress itself."""
    return progress.part(name, at_most) if isinstance(progress, Divisible) else progress


@final
@dataclass(frozen=True)
class ProgressListener:
    """A ProgressListener passes progress on and calls a function, or hides the error.

    Attributes:
        shown: the progress that shows it, part by part.
        hear: called after each report.
        with_error: whether the error is shown; it is a relative RMSE then.
    """

    shown: Progress
    hear: Callable[[], None] | None = None
    with_error: bool = True

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Show how far the work is, then call the listener."""
        self.shown(done, total, error if self.with_error else None)
        if self.hear is not None:
            self.hear()

    def part(self, name: str, at_most: bool) -> Progress:
        """Open a part of the stage, with the same listener."""
        return ProgressListener(part_of(self.shown, name, at_most), self.hear, self.with_error)


def quiet_stages(stage: str) -> Progress:
    """Open the progress of a stage that shows none."""
    return quiet
