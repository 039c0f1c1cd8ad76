"""This module divides samples of records into parts for training, validation and test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.noise_floor import SHORTEST_PIECE
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.record_files.record import RecordError
from slide_fmu.records.division import Block, Split, Splitting, split_pieces
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.rules import shares_of
from slide_fmu.records.specimens import too_few_specimens

FEWEST = 8
"""Least number of samples in a row with all outputs, in some place of each part."""
MOST = 0.9
"""Segments are short enough to use at least this part of the samples."""
MOST_BLOCKS = 5
"""Largest number of blocks of each part that are spread over a record, where the recipe does not
say. Each costs the samples of one lead."""


def divided(recipe: Recipe, source: MeasuredRecords) -> Split:
    """Divide the records of a recipe into its parts; the window's truncated part is the lead.

    Samples of the same inputs are in one part, unless ``has_known_inputs``.

    Raises:
        RecipeError: a part has too few samples, or the part to learn from has too few specimens
            for the parameters.
    """
    apart = _apart(recipe, source) if comes_again(source) else None
    return apart or _split(recipe, source, _lead(recipe))


def in_order_of_time(recipe: Recipe, source: MeasuredRecords) -> Split:
    """Divide the records of a recipe into its parts without leads, even if inputs repeat.

    A window is sized by this division, since ``divided`` itself needs a window. Each part is one
    stretch: a slow decay shows in long pieces only.
    """
    return _split(recipe, source, 0, rounds=1)


def most_blocks(recipe: Recipe, source: MeasuredRecords) -> int:
    """Return how many blocks each part may have, spread over the records, at least 1.

    It is the number in the recipe, or as many as the records have room for: the smallest part
    still scores as many samples in each block as its lead has, and enough to see noise.
    """
    if recipe.data.blocks is not None:
        return recipe.data.blocks
    smallest = min(share for share in shares_of(recipe).values() if share)
    if recipe.data.by == "record":
        room, least = len(source.files), 1
    else:
        room, least = int(source.numbers.max()) + 1, max(_lead(recipe), SHORTEST_PIECE)
        if recipe.bound is not None:
            least = max(least, recipe.bound.samples(recipe.window))
    if recipe.data.by == "each":
        lengths = np.zeros(len(source.files))
        for piece in source.pieces:
            lengths[piece.record] += len(piece.trajectory.inputs)
        room = min(room, int(lengths.min()))
    return max(1, min(MOST_BLOCKS, int(room * smallest / least)))


def has_known_inputs(recipe: Recipe, source: MeasuredRecords) -> bool:
    """Tell whether the parts for validation or test have inputs that are learnt from.

    That is so if inputs repeat, and if such a part has fewer different inputs than the window
    truncates. Every scored window there then has inputs of other parts, and cutting the records
    into short blocks would only lose samples.
    """
    return comes_again(source) and _apart(recipe, source) is None


def comes_again(source: MeasuredRecords) -> bool:
    """Tell whether some inputs of the records repeat."""
    return int(source.numbers.max()) + 1 < len(source.numbers)


def _lead(recipe: Recipe) -> int:
    return recipe.window.n_in - recipe.window.n_out


def _apart(recipe: Recipe, source: MeasuredRecords) -> Split | None:
    """Divide records so that repeated inputs are in one part; None if this does not help."""
    try:
        split = _split(recipe, source, _lead(recipe), source.numbers)
    except RecipeError:
        return None
    begins = np.cumsum([0, *(len(piece.trajectory.inputs) for piece in source.pieces)])
    for part, blocks in split.items():
        own = [source.numbers[begins[b.piece] :][b.scored : b.stop] for b in blocks]
        if part != "train" and len(np.unique(np.concatenate(own))) < _lead(recipe):
            return None
    return split


def _split(
    recipe: Recipe,
    source: MeasuredRecords,
    lead: int,
    numbers: NDArray[np.intp] | None = None,
    rounds: int | None = None,
) -> Split:
    """Divide records in a number of rounds; if None, in as many as leave samples to each part."""
    shares = {str(part): share for part, share in shares_of(recipe).items() if share}
    by = recipe.data.by
    most = most_blocks(recipe, source) if rounds is None else rounds
    least = most if recipe.data.blocks is not None else 1
    for number in range(most, least - 1, -1):
        try:
            split = split_pieces(source.pieces, Splitting(lead, by, shares, number), numbers)
            break
        except RecordError as error:
            if number == least:
                raise RecipeError(f"recipe {recipe.name!r}: {error}") from error
    problem = too_few_specimens(recipe, files_of(source, split["train"]))
    if problem is not None:
        raise RecipeError(f"recipe {recipe.name!r}: data.by = {by!r}: {problem}")
    return split


def scored_parts(recipe: Recipe, source: MeasuredRecords) -> Split:
    """Divide records as ``divided`` does, and cut scored ranges where outputs are missing.

    Leads are not cut, since they need no outputs.

    Raises:
        RecipeError: as in ``divided``, or outputs are missing nearly everywhere.
    """
    parts = {}
    for part, blocks in divided(recipe, source).items():
        runs = [own for block in blocks for own in _runs(source, block)]
        longest = max((block.stop - block.scored for block in runs), default=0)
        wanted = max(FEWEST, recipe.window.n_out)
        if longest < min(wanted, max(block.stop - block.scored for block in blocks)):
            raise RecipeError(
                f"recipe {recipe.name!r}: outputs are missing so often that at most {longest} "
                f"samples in a row have all of them in the part {part!r}; expected {wanted} in a "
                "row: leave out the lines of the file without outputs, if that makes even times "
                "of a longer step, learn fewer outputs, or give a smaller window.n_out"
            )
        parts[part] = tuple(runs)
    return parts


def longest_scored(recipe: Recipe, source: MeasuredRecords) -> int:
    """Return how many samples a segment can score if all parts for training use most samples.

    Most are ``MOST`` of the samples of each part, where gaps make blocks of unequal lengths.
    Blocks that are shorter than the window's output do not count.
    """
    parts = scored_parts(recipe, source)
    longest = []
    for part in parts:
        if part != "test":
            scored = [block.stop - block.scored for block in parts[part]]
            shortest = min(recipe.window.n_out, max(scored))
            lengths = np.sort([length for length in scored if length >= shortest])[::-1]
            share = np.cumsum(lengths) / lengths.sum()
            longest.append(int(lengths[np.searchsorted(share, MOST)]))
    return min(longest)


def files_of(source: MeasuredRecords, blocks: Sequence[Block]) -> list[int]:
    """Return the numbers of the files that blocks are cut from."""
    return [source.pieces[block.piece].record for block in blocks]


def _runs(source: MeasuredRecords, block: Block) -> list[Block]:
    """Cut a block into blocks that score whole outputs only; all keep its length of lead."""
    outputs = source.pieces[block.piece].trajectory.outputs
    known = np.isfinite(outputs[block.scored + 1 : block.stop + 1]).all(axis=1)
    edges = np.flatnonzero(np.diff(known.astype(np.int8), prepend=0, append=0)) + block.scored
    lead = block.scored - block.start
    return [
        Block(block.piece, begin - lead, begin, end)
        for begin, end in edges.reshape(-1, 2).tolist()
    ]
