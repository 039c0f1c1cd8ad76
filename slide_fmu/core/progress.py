"""How long work says how far it is: one protocol, from the work to whoever shows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable


class Progress(Protocol):
    """Shows how far one stage of the work is. Interface; any function of this form is one."""

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Take in how far the work is: at its start, and whenever a part of it is done.

        Args:
            done: parts of the work that are done.
            total: parts in all. Work that may end early says so when it opens a part of a stage
                (``part_of``), and ends with ``done = total``.
            error: the smallest validation error so far as relative RMSE, of work that looks for
                it; None or infinite as long as none is known.
        """


@runtime_checkable
class Divisible(Progress, Protocol):
    """A progress whose stage may have several parts, each with a total of its own. Interface."""

    def part(self, name: str, at_most: bool) -> Progress:
        """Open a part of the stage.

        Args:
            name: what the part does; empty for the stage itself.
            at_most: whether its total is the greatest possible one.
        """


Stages = Callable[[str], Progress]
"""Opens the progress of a named stage."""


def quiet(done: int, total: int, error: float | None = None) -> None:
    """Show no progress."""


def part_of(progress: Progress, name: str = "", at_most: bool = False) -> Progress:
    """Open a part of a stage where its progress knows parts; else they are all shown as one."""
    return progress.part(name, at_most) if isinstance(progress, Divisible) else progress


@dataclass(frozen=True)
class Heard:
    """What another progress shows is heard, too, or is shown without its error. Final.

    Attributes:
        shown: where it is shown, part by part.
        hear: is called whenever it was shown.
        with_error: whether the error is shown, which is a relative RMSE then.
    """

    shown: Progress
    hear: Callable[[], None] | None = None
    with_error: bool = True

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Show how far the work is, then let it be heard."""
        self.shown(done, total, error if self.with_error else None)
        if self.hear is not None:
            self.hear()

    def part(self, name: str, at_most: bool) -> Progress:
        """Open a part of the stage that is heard as well."""
        return Heard(part_of(self.shown, name, at_most), self.hear, self.with_error)


def quiet_stages(stage: str) -> Progress:
    """Open the progress of a stage that shows none."""
    return quiet
