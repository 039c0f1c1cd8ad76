"""Lengths that a recipe of records leaves open follow from a linear fit, and from its parts."""

from __future__ import annotations

from dataclasses import replace

from slide_fmu.memory.lengths import Lengths, both_lengths, tidy, with_window
from slide_fmu.memory.sizing import NotForgettingError
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import longest_scored
from slide_fmu.records.sizing import RecordSizing, size_records, wanted_samples


def lengths_of_records(recipe: OpenRecipe, source: MeasuredRecords) -> Lengths:
    """Find the lengths that a recipe leaves open; stretches are no longer than its parts.

    Raises:
        NotForgettingError: no window can hold what was measured, since it does not forget.
        RecipeError: what the recipe gives does not fit the window, or there are too few samples.
    """
    sizing = None
    n_in: int = recipe.guess.window.n_in
    n_out: int | None = None
    if "window.n_in" in recipe.open_keys:
        sizing = size_records(recipe.guess, source)
        if not sizing.forgets:
            raise NotForgettingError(f"recipe {recipe.guess.name!r}: {sizing.problem}")
        n_in, n_out = both_lengths(recipe, tidy(wanted_samples(sizing)))
    found = with_window(recipe, n_in, n_out)
    if sizing is not None:
        sizing = replace(sizing, window=found.recipe.guess.window.as_window)
    if "data.duration" not in recipe.open_keys:
        return replace(found, sizing=sizing)
    window = found.recipe.guess.window.as_window
    scored = round(found.recipe.guess.data.duration / window.step - window.n_truncated)
    most = longest_scored(found.recipe.guess, source)
    duration = round((min(scored, most) + window.n_truncated) * window.step, 12)
    data = {**found.values.get("data", {}), "duration": duration}
    values = {**found.values, "data": data}
    source_name = f"recipe {recipe.guess.name!r} with the lengths that its records need"
    return Lengths(recipe.with_found(values, source_name), values, sizing)


def lengths_of_case(
    source: MeasuredRecords, case: Case, open_keys: tuple[str, ...], patience: float
) -> Lengths:
    """Find the lengths that the recipe of a case leaves open, which takes no patience."""
    return lengths_of_records(OpenRecipe(case.recipe, open_keys), source)


def size_case(
    source: MeasuredRecords, case: Case, seed: int | None, patience: float
) -> RecordSizing:
    """Size the window of a case by a linear fit, which needs neither a seed nor patience."""
    return size_records(case.recipe, source)
