"""Trajectories that a test has made are read."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.data.trajectories import Split, Trajectories
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe


def read_split(recipe: Recipe, folder: Path, split: str, count: int | None = None) -> Split:
    """Read trajectories of a recipe from a folder; those that it asks for if ``count`` is None."""
    return Trajectories.of(case_of(recipe), folder).read(split, count)
