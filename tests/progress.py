"""Progress that nobody looks at."""

from __future__ import annotations

from slide_fmu.core.progress import Progress


def silent(done: int, total: int, error: float | None = None) -> None:
    """Show nothing."""


def no_stages(stage: str) -> Progress:
    """Show nothing of any stage."""
    return silent
