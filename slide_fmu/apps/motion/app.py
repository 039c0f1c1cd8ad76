"""This app adds motions: a subcommand, a factor on margins, and moves for pages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from slide_fmu.core.figures import plain
from slide_fmu.pipeline.apps import App

MARGIN_FACTOR = "margin_factor"
"""Key of the table ``[apps.motion]``: the factor on margins that ``--calibrate`` prints."""


def check_table(table: Mapping[str, Any]) -> None:
    """Accept ``margin_factor``, a number above 0, and nothing else."""
    from slide_fmu.recipe.recipe import RecipeError

    for key, value in table.items():
        if key != MARGIN_FACTOR:
            raise RecipeError(f"[apps.motion]: {key} is not a known key; expected {MARGIN_FACTOR}")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and 0 < value < math.inf):
            raise RecipeError(
                f"[apps.motion]: {MARGIN_FACTOR} = {value!r}; expected a number above 0, which "
                "slide-fmu motion --calibrate prints"
            )


def _moves(fmu: Path, task: Path) -> Any:
    """Return the move of a task, and the unshaped one, as plain values."""
    from slide_fmu.apps.motion.page_moves import solved_moves

    return plain(solved_moves(fmu, task))


APP = App(
    subcommands={"motion": "slide_fmu.apps.motion.command"},
    check_table=check_table,
    services={"moves of a task": _moves},
)
