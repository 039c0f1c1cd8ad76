"""A first recipe of records is held against them: a window must fit into every part.

What ``slide-fmu run`` would refuse after ``slide-fmu init`` has proposed it, is refused at once.
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
"""Short records get a window that leaves this part of what happened before it."""


def held_against(draft: RecordDraft, paths: Sequence[str]) -> tuple[RecordDraft, tuple[str, ...]]:
    """Return the draft with a window that fits into the records, and remarks.

    The window leaves more of the past than usual, if only such a one fits. The paths are those of
    the files from here.

    Raises:
        LoadError: the records cannot be used.
        RecipeError: no window fits, or the machine does not forget within the records.
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
    """Tell that the window leaves more of the past than it should."""
    if kept.remaining_amplitude == draft.remaining_amplitude:
        return None
    return (
        f"the records are short beside what the machine remembers: the window leaves "
        f"{100 * kept.remaining_amplitude:g} % of what happened before it; expected "
        f"{100 * draft.remaining_amplitude:g} %: record more, and write the recipe anew"
    )


def _too_short(recipe: Recipe, source: MeasuredRecords, refused: str) -> str:
    """Say how long records must be, for a window that leaves what it usually does."""
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
