"""How long work says how far it is: one protocol, from the work to whoever shows it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class Progress(Protocol):
    """Shows how far one stage of the work is. Interface; any function of this form is one."""

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        """Take in how far the work is: at its start, and whenever a part of it is done.

        Args:
            done: parts of the work that are done.
            total: parts in all; it may change while the work goes on.
            error: the smallest validation error so far, in the scaled units of the outputs, of
                work that looks for it.
        """


Stages = Callable[[str], Progress]
"""Opens the progress of a named stage."""


def quiet(done: int, total: int, error: float | None = None) -> None:
    """Show no progress."""


def quiet_stages(stage: str) -> Progress:
    """Open the progress of a stage that shows none."""
    return quiet
