"""Trajectories of measured records: blocks of their parts, cut to one length.

Samples of one part never stand in another, but as lead: those that fill the window, or burn in,
may lie in the part before, and are not scored there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Trajectory, on_circles
from slide_fmu.recipe.measured import shares_of
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.recipe.specimens import (
    scarce_specimens,
    specimens,
    too_few_specimens,
    values_in_file,
)
from slide_fmu.systems.record.blocks import Block, Split, Splitting
from slide_fmu.systems.record.measured import RecordError
from slide_fmu.systems.record.model import MeasuredRecords
from slide_fmu.systems.record.periods import find_period
from slide_fmu.systems.record.splitting import split_pieces

FEWEST = 8
"""So many samples in a row have all outputs somewhere in each part."""
MOST = 0.9
"""Stretches are so short that this part of the samples is used, at least."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """A Stretch is a trajectory that was measured at one go.

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


def divided(recipe: Recipe, source: MeasuredRecords, lead: int | None = None) -> Split:
    """Divide the records of a recipe into its parts; the window's truncated part leads in.

    The lead is another number of samples if it is not None.

    Raises:
        RecipeError: a part has too few samples, the inputs repeat no period although the recipe
            divides by periods, or the part to learn from has too few specimens for the parameters.
    """
    lead = recipe.window.n_in - recipe.window.n_out if lead is None else lead
    shares = {str(part): share for part, share in shares_of(recipe).items() if share}
    by = recipe.data.by
    try:
        splitting = Splitting(lead, by, shares, _period(source) if by == "period" else None)
        found = split_pieces(source.pieces, splitting)
    except RecordError as error:
        raise RecipeError(f"recipe {recipe.name!r}: {error}") from error
    problem = too_few_specimens(recipe, _files(source, found["train"]))
    if problem is not None:
        raise RecipeError(f"recipe {recipe.name!r}: data.by = {by!r}: {problem}")
    return found


def _files(source: MeasuredRecords, blocks: Sequence[Block]) -> list[int]:
    """Return the numbers of the files that blocks are cut from."""
    return [source.pieces[block.piece].record for block in blocks]


def learnt_pieces(recipe: Recipe, source: MeasuredRecords) -> list[list[Trajectory]]:
    """Return the whole blocks that are learnt from, without leads, of one specimen after another.

    Without physical parameters there is one.

    Raises:
        RecipeError: as of ``divided``.
    """
    blocks = divided(recipe, source, lead=0)["train"]
    found: dict[tuple[float, ...], list[Trajectory]] = {}
    for block, file in zip(blocks, _files(source, blocks), strict=True):
        specimen = tuple(values_in_file(recipe, file).values())
        found.setdefault(specimen, []).append(block.cut(source.pieces))
    return list(found.values())


def about_specimens(recipe: Recipe, source: MeasuredRecords) -> list[str | None]:
    """Say what the measured error does not tell of specimens; None stands for nothing to say.

    Raises:
        RecipeError: as of ``divided``.
    """
    if not recipe.parameters:
        return []
    parts = divided(recipe, source)
    learnt, tested = (
        [values_in_file(recipe, file) for file in _files(source, parts[part])]
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


def stretches(recipe: Recipe, source: MeasuredRecords, part: str) -> list[Stretch]:
    """Cut all blocks of a part into stretches of the recipe's duration, which all overlap.

    They overlap by the truncated part of the window, in which outputs may be missing, as NaN, but
    not in what is scored. The last stretch of a block ends where the
    block ends, so that none of its samples is lost, and a few are scored twice. A block that is
    shorter than a stretch is left out.

    Raises:
        RecipeError: as of ``divided``, or outputs are missing that an estimator needs.
    """
    lead = recipe.window.n_in - recipe.window.n_out
    scored = round(recipe.data.duration / recipe.window.step) - lead
    found = []
    for block in _with_outputs(recipe, source).get(part, ()):
        for first in _firsts(block, scored):
            whole = Block(block.piece, first - lead, first, first + scored)
            found.append(_stretch(recipe, source, whole))
    lacking = part.startswith("estimator") and not all(
        np.isfinite(one.trajectory.outputs).all() for one in found
    )
    if lacking:
        raise RecipeError(
            f"recipe {recipe.name!r}: outputs are missing in the part {part!r}; expected all of "
            "them for an error estimator: remove the table [estimator]"
        )
    return found


def remarks_on_division(recipe: Recipe, source: MeasuredRecords) -> list[str]:
    """Say what is lost of the records by their division.

    Raises:
        RecipeError: as of ``divided``.
    """
    found = [
        _behind_no_lead(recipe, source),
        left_out(recipe, source),
        *about_specimens(recipe, source),
    ]
    return [remark for remark in found if remark is not None]


def _with_outputs(recipe: Recipe, source: MeasuredRecords) -> Split:
    """Divide records as ``divided`` does, and cut what is scored where outputs are missing.

    What leads in is not cut: it needs no outputs.

    Raises:
        RecipeError: as of ``divided``, or outputs are missing nearly everywhere.
    """
    parts = {}
    for part, blocks in divided(recipe, source).items():
        found = [own for block in blocks for own in _runs(source, block)]
        longest = max((block.stop - block.scored for block in found), default=0)
        wanted = max(FEWEST, recipe.window.n_out)
        if longest < min(wanted, max(block.stop - block.scored for block in blocks)):
            raise RecipeError(
                f"recipe {recipe.name!r}: outputs are missing so often that at most {longest} "
                f"samples in a row have all of them in the part {part!r}; expected {wanted} in a "
                "row: leave out the lines of the file without outputs, if that makes even times "
                "of a longer step, learn fewer outputs, or give a smaller window.n_out"
            )
        parts[part] = tuple(found)
    return parts


def _runs(source: MeasuredRecords, block: Block) -> list[Block]:
    """Cut a block to those that score whole outputs only; all have its lead."""
    outputs = source.pieces[block.piece].trajectory.outputs
    known = np.isfinite(outputs[block.scored + 1 : block.stop + 1]).all(axis=1)
    edges = np.flatnonzero(np.diff(known.astype(np.int8), prepend=0, append=0)) + block.scored
    lead = block.scored - block.start
    return [
        Block(block.piece, begin - lead, begin, end)
        for begin, end in edges.reshape(-1, 2).tolist()
    ]


def _behind_no_lead(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which pieces are so short that nothing of them is scored; None if there are none."""
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


def left_out(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which blocks are shorter than a stretch, so that nothing is learnt from them.

    None if there are none.

    Raises:
        RecipeError: as of ``divided``.
    """
    lead = recipe.window.n_in - recipe.window.n_out
    scored = round(recipe.data.duration / recipe.window.step) - lead
    parts = _with_outputs(recipe, source)
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
    """Return how many samples a stretch can score so that all parts to learn from have most.

    That is ``MOST`` of the samples of each part, where gaps make blocks of unequal lengths; those
    that are shorter than the window's output do not count.

    Raises:
        RecipeError: as of ``divided``.
    """
    parts = _with_outputs(recipe, source)
    found = []
    for part in parts:
        if part != "test":
            scored = [block.stop - block.scored for block in parts[part]]
            shortest = min(recipe.window.n_out, max(scored))
            lengths = np.sort([length for length in scored if length >= shortest])[::-1]
            share = np.cumsum(lengths) / lengths.sum()
            found.append(int(lengths[np.searchsorted(share, MOST)]))
    return min(found)


def unseen_stretches(recipe: Recipe, source: MeasuredRecords) -> list[Stretch]:
    """Return the whole blocks on which an FMU is measured, led in by one window at most.

    Raises:
        RecipeError: as of ``divided``.
    """
    found = []
    for block in _with_outputs(recipe, source)["test"]:
        start = max(0, block.scored - recipe.window.n_in)
        whole = Block(block.piece, start, block.scored, block.stop)
        found.append(_stretch(recipe, source, whole))
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


def _stretch(recipe: Recipe, source: MeasuredRecords, block: Block) -> Stretch:
    (file,) = _files(source, [block])
    lead = block.scored - block.start
    return Stretch(block.cut(source.pieces), file, lead, values_in_file(recipe, file))


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
