"""This app adds motions: a subcommand, a factor on margins, and moves for pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.apps.motion.recipe_table import check_table
from slide_fmu.core.figures import plain
from slide_fmu.pipeline.apps import App


def _moves(fmu: Path, task: Path) -> Any:
    """Return the move of a task, and the unshaped one, as plain values."""
    from slide_fmu.apps.motion.page_moves import solved_moves

    return plain(solved_moves(fmu, task))


APP = App(
    subcommands={"motion": "slide_fmu.apps.motion.command"},
    check_table=check_table,
    moves=_moves,
)
