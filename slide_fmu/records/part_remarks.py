"""Remarks on the division of records name lost samples, and errors that are not measured."""

from __future__ import annotations

import numpy as np

from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import (
    comes_again,
    divided,
    files_of,
    has_known_inputs,
    scored_parts,
)
from slide_fmu.records.specimens import scarce_specimens, specimens, values_in_file


def remarks_on_division(recipe: Recipe, source: MeasuredRecords) -> list[str]:
    """Return remarks on the samples that are lost by the division.

    Raises:
        RecipeError: as in ``divided``.
    """
    remarks = [
        about_repeats(recipe, source),
        _behind_no_lead(recipe, source),
        left_out(recipe, source),
        *about_specimens(recipe, source),
    ]
    return [remark for remark in remarks if remark is not None]


def about_repeats(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say how many inputs repeat, and how this affects the error; None if no input repeats.

    Raises:
        RecipeError: as in ``divided``.
    """
    if not comes_again(source):
        return None
    lengths = [len(piece.trajectory.inputs) for piece in source.pieces]
    files = np.repeat([piece.record for piece in source.pieces], lengths)
    order = np.argsort(source.numbers, kind="stable")
    again = np.diff(source.numbers[order]) == 0
    before, later = order[:-1][again], order[1:][again]
    alike = np.unique(files[[before, later]][:, files[before] != files[later]])
    if len(alike):
        where = f"{', '.join(source.files[file] for file in alike)} have them in common"
    else:
        lag = int(np.median(later - before))
        where = f"mostly {lag * source.step:.6g} s ({lag} samples) later"
    if has_known_inputs(recipe, source):
        meaning = (
            "too few are different to hold some of them back, so what is tested was learnt from, "
            "and the error says nothing about other inputs: record other inputs too"
        )
    else:
        meaning = "each part has inputs of its own, and all samples that repeat them"
    return f"{100 * len(later) / len(order):.0f} % of the inputs come again, {where}; {meaning}"


def about_specimens(recipe: Recipe, source: MeasuredRecords) -> list[str | None]:
    """Say which errors of specimens are not measured; None if all are.

    Raises:
        RecipeError: as in ``divided``.
    """
    if not recipe.parameters:
        return []
    parts = divided(recipe, source)
    learnt, tested = (
        [values_in_file(recipe, file) for file in files_of(source, parts[part])]
        for part in ("train", "test")
    )
    lacking = [one for one in specimens(recipe) if one not in tested]
    names = "; ".join(", ".join(f"{k} = {v:g}" for k, v in one.items()) for one in lacking)
    seen = all(one in learnt for one in tested)
    return [
        scarce_specimens(recipe),
        f"no error is measured at {names}: the part to test has none of these records; give it a "
        'larger share, or divide each file by itself (data.by = "each")'
        if lacking and seen
        else None,
        "the error is measured on specimens that were learnt from; to see the one between them, "
        'hold whole files out (data.by = "record"; the last ones are tested)'
        if seen
        else None,
    ]


def left_out(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which blocks are shorter than a segment, and so are not learnt from.

    None if no block is.

    Raises:
        RecipeError: as in ``divided``.
    """
    lead = recipe.window.n_in - recipe.window.n_out
    scored = round(recipe.data.duration / recipe.window.step) - lead
    parts = scored_parts(recipe, source)
    blocks = [block for part, own in parts.items() if part != "test" for block in own]
    short = [b.stop - b.scored for b in blocks if b.stop - b.scored < scored]
    if not short:
        return None
    return (
        f"{len(short)} of {len(blocks)} blocks of the records, with {sum(short)} samples to learn "
        f"from, are shorter than data.duration = {recipe.data.duration:g} s and left out: give a "
        "shorter duration to use them"
    )


def _behind_no_lead(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which pieces are too short to be scored; None if no piece is."""
    lead = recipe.window.n_in - recipe.window.n_out
    lengths = [len(piece.trajectory.inputs) for piece in source.pieces]
    short = [length for length in lengths if length <= lead]
    if not short:
        return None
    return (
        f"{len(short)} of {len(lengths)} pieces of the records, with {sum(short)} of "
        f"{sum(lengths)} samples, are no longer than the {lead} samples that the window truncates "
        "and left out: nobody knows what was before them. Record with fewer gaps, or shorten the "
        "window"
    )
