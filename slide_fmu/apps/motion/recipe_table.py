"""A recipe may have a table ``[apps.motion]``, with a factor on margins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

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
