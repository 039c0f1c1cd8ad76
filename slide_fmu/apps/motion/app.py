"""What motions add: the subcommand, and moves for pages."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.core.figures import JsonObject
from slide_fmu.pipeline.apps import App


def _moves(fmu: Path, task: Path) -> JsonObject:
    from slide_fmu.apps.motion.page_moves import solved_moves

    return solved_moves(fmu, task)


APP = App(
    subcommands={"motion": "slide_fmu.apps.motion.command"}, services={"moves of a task": _moves}
)
