"""This module finds open lengths of a recipe once, and keeps them in its run folder."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TypedDict

import numpy as np

from slide_fmu.core.kept import Memo
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.fingerprint import identity, same_motion
from slide_fmu.memory.lengths import Lengths, find_lengths
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.pipeline.case_checks import guarded_case
from slide_fmu.recipe.automatic import FoundValues, Tables
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.systems.base import System

DECIDES = {"system", "window", "data", "estimator", "parameters"}
"""Tables of a recipe on which its lengths depend."""


class MadeFrom(TypedDict):
    """MadeFrom holds the origin of a memo, as in its JSON.

    Attributes:
        recipe: tables of the recipe that it depends on.
        probe: outputs of a short motion of its model.
    """

    recipe: Tables
    probe: list[list[float]]


def resolved_lengths(
    case: Case, open_keys: tuple[str, ...], place: Path, patience: float = math.inf
) -> tuple[FoundValues, AnySizing | None]:
    """Return the open lengths of a recipe, and the sizing of the window if it was done now.

    The open keys of the case's recipe hold first guesses. Lengths are read from the file at
    ``place`` if it belongs to the same recipe and model; else they are found from the system's
    motions, and kept there. If motions were left out because of the patience, in s, the lengths
    are not kept.

    Raises:
        DamagedFileError: the file is there, and damaged.
        LoadError: the source of the recipe cannot be made.
        ShortWindowError: no window can hold the system.
        RecipeError: the recipe does not fit the window that its system needs.
        UnstableModeError, SimulationError, ValueError: as in ``size_window``.
    """
    recipe, source = case.recipe, case.source
    asked = {**recipe.model_dump(mode="json", include=DECIDES), "open_keys": list(open_keys)}
    motion = identity(source, recipe)
    memo = memo_of(place, asked, motion)
    kept: FoundValues | None = memo.found("values")
    if kept is not None:
        return kept, None
    found = lengths_of_case(source, case, open_keys, patience)
    if found.sizing is not None and found.sizing.left_out is not None:
        return found.values, found.sizing
    memo.keep("values", found.values)
    return found.values, found.sizing


@asked_of_sources
def lengths_of_case(
    system: System, case: Case, open_keys: tuple[str, ...], patience: float
) -> Lengths:
    """Find the open lengths of a recipe, in a separate program if its system may crash."""
    return guarded_case(case, _lengths, open_keys, patience)


def _lengths(case: Case, open_keys: tuple[str, ...], patience: float) -> Lengths:
    """Find lengths; with physical parameters, of the corner with the longest memory.

    The eigenvalues alone do not show this corner.
    """
    cases = [case.at_ends(corner) for corner in case.corners()]
    found = [
        find_lengths(OpenRecipe(one.recipe, open_keys), one.system, TimeBudget(patience))
        for one in cases
    ]
    return max(found, key=lambda lengths: lengths.recipe.guess.window.n_in)


def memo_of(place: Path, asked: Tables, motion: FloatArray) -> Memo:
    """Return the memo that depends on tables of a recipe and its model's short motion."""
    made_from: MadeFrom = {"recipe": asked, "probe": motion.tolist()}
    return Memo(place, made_from, _same_model)


def _same_model(kept: MadeFrom, now: MadeFrom) -> bool:
    """Tell whether recipe and model are the same, but for rounding."""
    probes = (np.array(one["probe"]) for one in (kept, now))
    return kept["recipe"] == now["recipe"] and same_motion(*probes)
