"""This module chooses a window for a first recipe of records that fits into every part.

A recipe that ``slide-fmu run`` would refuse is refused by ``slide-fmu init`` already.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from slide_fmu.memory.lengths import tidy
from slide_fmu.memory.sizing import NotForgettingError
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.part_remarks import about_repeats
from slide_fmu.records.recipe_text import RecordDraft, record_recipe_text
from slide_fmu.records.rules import shares_of
from slide_fmu.records.sizing import lengths_of_records, size_records, wanted_samples

COARSER = 1e-2
"""Remaining amplitude of initial effects that the window of short records leaves."""


def held_against(draft: RecordDraft, paths: Sequence[str]) -> tuple[RecordDraft, tuple[str, ...]]:
    """Return the draft with a window that fits into the records, and remarks.

    The window leaves a larger remaining amplitude than usual if only such a window fits. The paths
    are relative to the current folder.

    Raises:
        LoadError: the records cannot be used.
        RecipeError: no window fits, or initial effects do not decay within the records.
    """
    refused: RecipeError | None = None
    usual = _recipe(draft, paths)
    source = case_of(usual.guess).source
    assert isinstance(source, MeasuredRecords)
    for remaining in (draft.remaining_amplitude, COARSER):
        recipe = _recipe(replace(draft, remaining_amplitude=remaining), paths)
        try:
            found = lengths_of_records(recipe, source)
        except NotForgettingError as error:
            raise RecipeError(str(error)) from error
        except RecipeError as error:
            refused = refused or error
            continue
        few = None if found.sizing is None else found.sizing.remark
        kept = replace(draft, remaining_amplitude=remaining)
        again = about_repeats(found.recipe.guess, source)
        remarks = again, few, _coarser(draft, kept)
        return kept, tuple(remark for remark in remarks if remark)
    raise RecipeError(_too_short(usual.guess, source, str(refused))) from refused


def _recipe(draft: RecordDraft, paths: Sequence[str]) -> OpenRecipe:
    text = record_recipe_text(replace(draft, paths=paths))
    return parse_open_recipe(text, f"recipe {draft.name!r}")


def _coarser(draft: RecordDraft, kept: RecordDraft) -> str | None:
    """Return a remark that the window leaves a larger amplitude than usual."""
    if kept.remaining_amplitude == draft.remaining_amplitude:
        return None
    return (
        f"the records are short compared with the memory of the machine: the window leaves "
        f"{100 * kept.remaining_amplitude:g} % of what happened before it; expected "
        f"{100 * draft.remaining_amplitude:g} %: record more, and write the recipe anew"
    )


def _too_short(recipe: Recipe, source: MeasuredRecords, refused: str) -> str:
    """Return the message that the records are too short for the usual remaining amplitude."""
    sizing = size_records(recipe, source)
    lead, smallest = tidy(wanted_samples(sizing)), min(s for s in shares_of(recipe).values() if s)
    samples = sum(len(piece.trajectory.inputs) for piece in source.pieces)
    return (
        f"the records have {samples} samples, and the machine remembers {lead} of them, by the "
        f"slowest pole of a linear fit ({sizing.decay.time:.3g} s to "
        f"{recipe.window.remaining_amplitude:g}); expected at least "
        f"{math.ceil(lead / smallest)} samples, so that each part is longer than that: record "
        f"more ({refused})"
    )
