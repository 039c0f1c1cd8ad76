"""Trajectories of measured records: blocks of their parts, cut to one length.

Samples of one part never stand in another, but as lead: those that fill the window, or burn in,
may lie in the part before, and are not scored there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Trajectory, on_circles
from slide_fmu.recipe.measured import shares_of
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.record.blocks import Block, Split, Splitting
from slide_fmu.systems.record.measured import RecordError
from slide_fmu.systems.record.model import MeasuredRecords
from slide_fmu.systems.record.periods import find_period
from slide_fmu.systems.record.splitting import split_pieces


@dataclass(frozen=True, eq=False)
class Stretch:
    """A Stretch is a trajectory that was measured at one go.

    Attributes:
        trajectory: N inputs and N + 1 outputs in their units, the lead included.
        file: number of the file that it comes from.
        lead: number of its first inputs whose outputs are not scored.
    """

    trajectory: Trajectory
    file: int
    lead: int


def divided(recipe: Recipe, source: MeasuredRecords, lead: int | None = None) -> Split:
    """Divide the records of a recipe into its parts; the window's truncated part leads in.

    The lead is another number of samples if it is not None.

    Raises:
        RecipeError: a part has too few samples, or the inputs repeat no period although the
            recipe divides by periods.
    """
    lead = recipe.window.n_in - recipe.window.n_out if lead is None else lead
    shares = {str(part): share for part, share in shares_of(recipe).items() if share}
    by = recipe.data.by
    try:
        splitting = Splitting(lead, by, shares, _period(source) if by == "period" else None)
        return split_pieces(source.pieces, splitting)
    except RecordError as error:
        raise RecipeError(f"recipe {recipe.name!r}: {error}") from error


def learnt_pieces(recipe: Recipe, source: MeasuredRecords) -> list[Trajectory]:
    """Return the whole blocks that are learnt from, without leads.

    Raises:
        RecipeError: as of ``divided``.
    """
    blocks = divided(recipe, source, lead=0)["train"]
    return [block.cut(source.pieces) for block in blocks]


def stretches(recipe: Recipe, source: MeasuredRecords, part: str) -> list[Stretch]:
    """Cut all blocks of a part into stretches of the recipe's duration, which all overlap.

    They overlap by the truncated part of the window. The last stretch of a block ends where the
    block ends, so that none of its samples is lost, and a few are scored twice. A block that is
    shorter than a stretch is left out.

    Raises:
        RecipeError: as of ``divided``.
    """
    lead = recipe.window.n_in - recipe.window.n_out
    scored = round(recipe.data.duration / recipe.window.step) - lead
    found = []
    for block in divided(recipe, source).get(part, ()):
        for first in _firsts(block, scored):
            whole = Block(block.piece, first - lead, first, first + scored)
            found.append(_stretch(source, whole))
    return found


def left_out(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which blocks are shorter than a stretch, so that nothing is learnt from them.

    None if there are none.

    Raises:
        RecipeError: as of ``divided``.
    """
    lead = recipe.window.n_in - recipe.window.n_out
    scored = round(recipe.data.duration / recipe.window.step) - lead
    parts = divided(recipe, source)
    blocks = [block for part, found in parts.items() if part != "test" for block in found]
    short = [b.stop - b.scored for b in blocks if b.stop - b.scored < scored]
    if not short:
        return None
    return (
        f"{len(short)} of {len(blocks)} blocks of the records, with {sum(short)} samples to learn "
        f"from, are shorter than data.duration = {recipe.data.duration:g} s and left out: give a "
        "shorter duration to use them"
    )


def longest_stretch(recipe: Recipe, source: MeasuredRecords) -> int:
    """Return how many samples a stretch can score so that every part to learn from has one.

    Raises:
        RecipeError: as of ``divided``.
    """
    parts = divided(recipe, source)
    longest = [max(b.stop - b.scored for b in parts[part]) for part in parts if part != "test"]
    return min(longest)


def unseen_stretches(recipe: Recipe, source: MeasuredRecords) -> list[Stretch]:
    """Return the whole blocks on which an FMU is measured, led in by one window at most.

    Raises:
        RecipeError: as of ``divided``.
    """
    found = []
    for block in divided(recipe, source)["test"]:
        start = max(0, block.scored - recipe.window.n_in)
        found.append(_stretch(source, Block(block.piece, start, block.scored, block.stop)))
    return found


def inputs_beyond(
    recipe: Recipe, source: MeasuredRecords, count: int, number: int, factor: float
) -> FloatArray:
    """Return ``number`` stretches of the inputs that are learnt from, all with a larger amplitude.

    Their deviations from the mean are multiplied by the factor. They begin evenly spread over the
    training part, which runs to and fro where it is shorter than a stretch of ``count`` samples.
    The shape is (number, count, n_inputs).

    Raises:
        RecipeError: as of ``divided``.
    """
    blocks = [block.cut(source.pieces).inputs for block in divided(recipe, source)["train"]]
    mean = np.concatenate(blocks).mean(axis=0)
    found = []
    for index in range(number):
        inputs = blocks[index % len(blocks)]
        if len(inputs) < count:
            inputs = np.pad(inputs, ((0, count - len(inputs)), (0, 0)), mode="symmetric")
        first = (len(inputs) - count) * index // max(1, number - 1)
        larger = mean + factor * (inputs[first : first + count] - mean)
        found.append(on_circles(source.inputs, larger))
    return np.stack(found)


def _stretch(source: MeasuredRecords, block: Block) -> Stretch:
    file = source.pieces[block.piece].record
    return Stretch(block.cut(source.pieces), file, block.scored - block.start)


def _firsts(block: Block, scored: int) -> list[int]:
    """Return where stretches of a block begin to be scored."""
    rest = block.stop - block.scored
    if rest < scored:
        return []
    firsts = list(range(block.scored, block.stop - scored + 1, scored))
    return firsts if firsts[-1] + scored == block.stop else [*firsts, block.stop - scored]


def _period(source: MeasuredRecords) -> int:
    longest = max(source.pieces, key=lambda piece: len(piece.trajectory.inputs))
    found = find_period(longest.trajectory.inputs)
    if found is None:
        raise RecordError(
            'data.by = "period", but the inputs repeat no period; expected some that do: set '
            'data.by = "block"'
        )
    return found.samples
