"""This module finds open lengths of a recipe once, and keeps them in its run folder."""

from __future__ import annotations

import math
from pathlib import Path

from slide_fmu.core.result_cache import ResultFile
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.model_answers import identity, model_key
from slide_fmu.memory.lengths import Lengths, find_lengths
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.pipeline.case_checks import guarded_case
from slide_fmu.recipe.automatic import FoundValues
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.systems.base import System

DECIDES = {"system", "window", "data", "estimator", "parameters"}
"""Tables of a recipe on which its lengths depend."""


def resolved_lengths(
    case: Case, open_keys: tuple[str, ...], cache: Path, patience: float = math.inf
) -> tuple[FoundValues, AnySizing | None]:
    """Return the open lengths of a recipe, and the sizing of the window if it was done now.

    The open keys of the case's recipe hold first guesses. Lengths are read from the folder
    ``cache`` if they were found there for the same recipe and model; else they are found from the
    system's motions, and kept there. If motions were left out because of the patience, in s, the
    lengths are not kept.
    """
    recipe, source = case.recipe, case.source
    tables = recipe.model_dump(mode="json", include=DECIDES)
    model = model_key(cache, identity(source, recipe))
    file = ResultFile.of(cache, "resolved", tables, open_keys, model)
    known = file.read_json(FoundValues)
    if known is not None:
        return known, None
    lengths = lengths_of_case(source, case, open_keys, patience)
    if lengths.sizing is None or lengths.sizing.left_out is None:
        file.write_json(lengths.values)
    return lengths.values, lengths.sizing


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
    of_corners = [
        find_lengths(OpenRecipe(one.recipe, open_keys), one.system, TimeBudget(patience))
        for one in cases
    ]
    return max(of_corners, key=lambda lengths: lengths.recipe.guess.window.n_in)
