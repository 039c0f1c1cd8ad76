"""This module cuts the parts of measured records into segments of one length.

A segment scores samples of one part alone. Only its lead, which fills the window or burns in, may
lie in the part before; it is not scored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.core.signals import FloatArray, Trajectory, on_circles
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.decay import ORDERS
from slide_fmu.records.division import Block
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import files_of, in_order_of_time, scored_parts
from slide_fmu.records.rules import OF_BOUND, OF_ESTIMATOR
from slide_fmu.records.specimens import values_in_file


@dataclass(frozen=True, eq=False)
class Segment:
    """A Segment is a measured trajectory without gaps.

    Attributes:
        trajectory: N inputs and N + 1 outputs in their units, the lead included.
        file: number of the file that it comes from.
        lead: number of its first inputs whose outputs are not scored.
        parameters: physical parameters of the specimen in the file, by name.
    """

    trajectory: Trajectory
    file: int
    lead: int
    parameters: dict[str, float]


def learnt_pieces(recipe: Recipe, source: MeasuredRecords) -> list[list[Trajectory]]:
    """Return the whole blocks by which a window is sized, a list for each specimen.

    They are the blocks to learn from in the order of time, without leads; but before a piece that
    begins at rest, so many samples at rest as a linear fit looks back. Without physical parameters
    there is one specimen.
    """
    blocks = in_order_of_time(recipe, source)["train"]
    by_specimen: dict[tuple[float, ...], list[Trajectory]] = {}
    for block, file in zip(blocks, files_of(source, blocks), strict=True):
        specimen = tuple(values_in_file(recipe, file).values())
        if block.start == 0 and source.pieces[block.piece].rest is not None:
            block = replace(block, start=-ORDERS[-1])
        by_specimen.setdefault(specimen, []).append(block.cut(source.pieces))
    return list(by_specimen.values())


def segments(recipe: Recipe, source: MeasuredRecords, part: str) -> list[Segment]:
    """Cut all blocks of a part into segments of the recipe's duration, which overlap.

    They overlap by the truncated part of the window, or by all samples that fill an error bound
    where the part is the bound's. Outputs may be missing (NaN) in the overlap, but not in the
    scored samples. The last segment of a block ends where the block ends, so that no sample is
    lost and a few are scored twice. A block that is shorter than a segment is left out.

    Raises:
        RecipeError: as of ``divided``, or outputs are missing that an estimator or a bound needs.
    """
    lead = lead_of(recipe, part)
    scored = round(recipe.data.duration / recipe.window.step) - lead
    cut = []
    for block in scored_parts(recipe, source).get(part, ()):
        before = block.scored if source.pieces[block.piece].rest is None else math.inf
        begin = block.scored + max(0, lead - before)  # earlier, too few inputs are known
        for first in _firsts(replace(block, scored=int(begin)), scored):
            whole = Block(block.piece, first - lead, first, first + scored)
            cut.append(_segment(recipe, source, whole))
    table = "estimator" if part in OF_ESTIMATOR else "bound" if part in OF_BOUND else None
    if table and not all(np.isfinite(one.trajectory.outputs).all() for one in cut):
        raise RecipeError(
            f"recipe {recipe.name!r}: outputs are missing in the part {part!r}; expected all of "
            f"them for an error {table}: remove the table [{table}]"
        )
    return cut


def lead_of(recipe: Recipe, part: str) -> int:
    """Return the number of first samples of a part's segments that are not scored."""
    window = recipe.window
    if recipe.bound is None or part not in OF_BOUND:
        return window.n_in - window.n_out
    return max(window.n_in, recipe.bound.filling(window))


def unseen_blocks(recipe: Recipe, source: MeasuredRecords) -> list[Segment]:
    """Return the blocks on which an FMU is measured, each with a lead.

    It has one window at most, or what fills an error bound.
    """
    unseen, lead = [], max(recipe.window.n_in, *(lead_of(recipe, part) for part in OF_BOUND))
    for block in scored_parts(recipe, source)["test"]:
        known = 0 if source.pieces[block.piece].rest is None else lead
        start = max(-known, block.scored - lead)
        whole = Block(block.piece, start, block.scored, block.stop)
        unseen.append(_segment(recipe, source, whole))
    return unseen


def inputs_beyond(
    recipe: Recipe, source: MeasuredRecords, count: int, number: int, factor: float
) -> FloatArray:
    """Return ``number`` segments of the records' inputs, all with a larger amplitude.

    Their deviations from the mean are multiplied by the factor. Their starts are evenly spread
    over all parts, so that they reach the states that the records reach. A piece is mirrored at
    its ends where it is shorter than ``count`` samples. The shape is (number, count, n_inputs).
    """
    blocks = [piece.trajectory.inputs for piece in source.pieces]
    mean = np.concatenate(blocks).mean(axis=0)
    beyond = []
    for index in range(number):
        inputs = blocks[index % len(blocks)]
        if len(inputs) < count:
            inputs = np.pad(inputs, ((0, count - len(inputs)), (0, 0)), mode="symmetric")
        first = (len(inputs) - count) * index // max(1, number - 1)
        larger = mean + factor * (inputs[first : first + count] - mean)
        beyond.append(on_circles(source.inputs, larger))
    return np.stack(beyond)


def _segment(recipe: Recipe, source: MeasuredRecords, block: Block) -> Segment:
    (file,) = files_of(source, [block])
    lead = block.scored - block.start
    return Segment(block.cut(source.pieces), file, lead, values_in_file(recipe, file))


def _firsts(block: Block, scored: int) -> list[int]:
    """Return the first scored sample of each segment of a block."""
    rest = block.stop - block.scored
    if rest < scored:
        return []
    firsts = list(range(block.scored, block.stop - scored + 1, scored))
    return firsts if firsts[-1] + scored == block.stop else [*firsts, block.stop - scored]
