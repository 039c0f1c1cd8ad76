"""What kinds of motion a recipe has: kinds of excitation of a model, or files of records."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from slide_fmu.excitation.mix import names_of
from slide_fmu.recipe.recipe import Recipe


class Motion(NamedTuple):
    """A Motion is a kind of motion: its name, unlike all others, and what kind it is."""

    name: str
    kind: str


def motions_of(recipe: Recipe) -> list[Motion]:
    """Return the kinds of motion, in the order in which trajectories have their numbers."""
    if recipe.system.is_record:
        paths = [Path(path) for path in (recipe.system.model, *recipe.system.further)]
        names = [path.name for path in paths]
        alike = len(set(names)) < len(names)
        return [Motion(str(path) if alike else path.name, "measured") for path in paths]
    kinds = recipe.data.excitation
    return [Motion(*pair) for pair in zip(names_of(kinds), (k.kind for k in kinds), strict=True)]
