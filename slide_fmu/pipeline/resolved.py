"""What a recipe leaves to be found is found once, and kept in its run folder."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.kept import Memo
from slide_fmu.core.parameters import corners_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.fingerprint import identity, same_motion
from slide_fmu.memory.lengths import Lengths, find_lengths
from slide_fmu.memory.patience import Patience
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.pipeline.checks import check_recipe, guarded_recipe
from slide_fmu.recipe.automatic import LENGTHS
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.systems import recipe_source, source_at
from slide_fmu.systems.base import System

Resolved = dict[str, dict[str, Any]]
"""Values by table and key of a recipe, as ``{"window": {"n_in": 96}}``."""

DECIDES = {"system", "window", "data", "estimator", "parameters", "automatic"}
"""Tables of a recipe on which its lengths depend."""


def resolved_lengths(
    recipe: Recipe, place: Path, patience: float = math.inf
) -> tuple[Resolved, AnySizing | None]:
    """Return the lengths that a recipe leaves open, and how the window was sized, if it was now.

    There are none if it leaves none open. They are those that the file at ``place`` keeps, if it
    is about the same recipe and model; else they are found from the system's motions, and kept
    there. Those that are found in a limited time, the patience in s, are not kept if anything was
    left out for it.

    Raises:
        DamagedFileError: the file is there, and damaged.
        LoadError, RecipeError: as of ``check_recipe``.
        ShortWindowError: no window can hold the system.
        RecipeError: what the recipe gives does not fit the window that its system needs.
        UnstableModeError, SimulationError, ValueError: as of ``size_window``.
    """
    if not any(key in LENGTHS for key in recipe.automatic):
        return {}, None
    check_recipe(recipe)
    system = recipe_source(recipe)
    asked, motion = recipe.model_dump(mode="json", include=DECIDES), identity(recipe, system)
    memo = memo_of(place, asked, motion)
    kept: Resolved | None = memo.found("values")
    if kept is not None:
        return kept, None
    if isinstance(system, System):
        found = guarded_recipe(recipe, system, _lengths, patience)
    else:
        found = find_lengths(recipe, system, Patience(patience))
    if found.sizing is not None and found.sizing.left_out is not None:
        return found.values, found.sizing
    memo.keep("values", found.values)
    return found.values, found.sizing


def _lengths(recipe: Recipe, patience: float) -> Lengths:
    """Find lengths; of a recipe with physical parameters those of the corner that asks for most.

    There the memory is longest, and the eigenvalues alone do not tell it.
    """
    if not recipe.parameters:
        return find_lengths(recipe, recipe_source(recipe), Patience(patience))
    found = [
        find_lengths(recipe.at(corner), source_at(recipe, corner), Patience(patience))
        for corner in corners_of(recipe.physical())
    ]
    return max(found, key=lambda lengths: lengths.recipe.window.n_in)


def memo_of(place: Path, asked: dict[str, Any], motion: FloatArray) -> Memo:
    """Return the memo of what tables of a recipe, and its model's short motion, decide."""
    return Memo(place, {"recipe": asked, "probe": motion.tolist()}, _same_model)


def _same_model(kept: dict[str, Any], now: dict[str, Any]) -> bool:
    """Tell whether recipe and model are the same, but for rounding."""
    probes = (np.array(one["probe"]) for one in (kept, now))
    return kept["recipe"] == now["recipe"] and same_motion(*probes)
