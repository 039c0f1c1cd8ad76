"""Which samples of prepared pieces are learnt from, which choose, and which test."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slide_fmu.records.alike import alike_inputs, groups_of_records
from slide_fmu.records.blocks import Block, Split, Splitting
from slide_fmu.records.measured import RecordError
from slide_fmu.records.period_cuts import whole_periods
from slide_fmu.records.preparation import Piece

Range = tuple[int, int, int]
"""Piece, begin, end (excluded)."""


def split_pieces(pieces: Sequence[Piece], splitting: Splitting) -> Split:
    """Divide pieces into parts, as training, validation and test.

    Blocks are cut in the order of time, each part behind the one before. Every part must score as
    many samples as its lead has, since a shorter one shows no error that is older than it.

    Raises:
        RecordError: a part has too few samples, or there are fewer records or different periods
            than parts; the message has the figures.
    """
    ways = {"block": _by_block, "each": _by_each, "record": _by_record, "period": _by_period}
    parts = ways[splitting.by](pieces, splitting)
    blocks = [_blocks(ranges, splitting.lead) for ranges in parts]
    for (name, share), found in zip(splitting.shares.items(), blocks, strict=True):
        scored = sum(block.stop - block.scored for block in found)
        if share and scored < max(1, splitting.lead):
            total = sum(len(piece.trajectory.inputs) for piece in pieces)
            raise RecordError(
                f"{name} has {scored} samples to score, of {total} in {len(pieces)} pieces, "
                f"behind leads of {splitting.lead}; expected at least "
                f"{max(1, splitting.lead)}: record more, shorten the window, or give this part "
                "a larger share"
            )
    named = zip(splitting.shares, blocks, strict=True)
    return {name: tuple(found) for name, found in named}


def _blocks(ranges: list[Range], lead: int) -> list[Block]:
    """Put the lead before each range, as far as there are samples; else score later."""
    blocks = [
        Block(piece, max(0, begin - lead), max(begin, lead), end) for piece, begin, end in ranges
    ]
    return [block for block in blocks if block.scored < block.stop]


def _by_block(pieces: Sequence[Piece], splitting: Splitting) -> list[list[Range]]:
    """Cut all pieces, laid end to end, at the shares."""
    lengths = [len(piece.trajectory.inputs) for piece in pieces]
    begins = np.concatenate([[0], np.cumsum(lengths)])
    shares = [0.0, *splitting.shares.values()]
    cuts = np.round(begins[-1] * np.cumsum(shares)).astype(int)
    parts: list[list[Range]] = []
    for low, high in pairwise(cuts):
        ranges = [
            (index, int(max(low, begin) - begin), int(min(high, begin + length) - begin))
            for index, (begin, length) in enumerate(zip(begins[:-1], lengths, strict=True))
        ]
        parts.append([r for r in ranges if r[1] < r[2]])
    return parts


def _by_each(pieces: Sequence[Piece], splitting: Splitting) -> list[list[Range]]:
    """Cut the pieces of every record at the shares."""
    parts: list[list[Range]] = [[] for _ in splitting.shares]
    for record in dict.fromkeys(piece.record for piece in pieces):
        own = [index for index, piece in enumerate(pieces) if piece.record == record]
        found = _by_block([pieces[index] for index in own], splitting)
        for part, ranges in zip(parts, found, strict=True):
            part += [(own[index], begin, end) for index, begin, end in ranges]
    return parts


def _by_record(pieces: Sequence[Piece], splitting: Splitting) -> list[list[Range]]:
    """Give each part whole records, with all their pieces; those that are alike to the same."""
    numbers = sorted({piece.record for piece in pieces})
    inputs = [[p.trajectory.inputs for p in pieces if p.record == n] for n in numbers]
    alike = alike_inputs([np.concatenate(own) for own in inputs])
    group = dict(zip(numbers, groups_of_records(alike, len(numbers)), strict=True))
    members: dict[int, list[Range]] = {}
    for index, piece in enumerate(pieces):
        one = (index, 0, len(piece.trajectory.inputs))
        members.setdefault(group[piece.record], []).append(one)
    return _shared_out(list(members.values()), splitting, "records of different inputs")


def _by_period(pieces: Sequence[Piece], splitting: Splitting) -> list[list[Range]]:
    """Give each part whole periods, those that are alike to the same; a rest is left out."""
    period = splitting.period or 1
    found = whole_periods([piece.trajectory.inputs for piece in pieces], period)
    if not found:
        return [[] for _ in splitting.shares]
    members: dict[int, list[Range]] = {}
    for one in found:
        members.setdefault(one.number, []).append((one.piece, one.begin, one.end))
    parts = _shared_out(
        list(members.values()), splitting, f"different periods of {period} samples"
    )
    return [_joined(sorted(part)) for part in parts]


def _shared_out(groups: list[list[Range]], splitting: Splitting, what: str) -> list[list[Range]]:
    """Give each part the next groups, at least one, until it has about its share of samples."""
    shares = list(splitting.shares.values())
    wanted = sum(share > 0 for share in shares)
    if len(groups) < wanted:
        raise RecordError(
            f"there are {len(groups)} {what} for {wanted} parts; expected at least one for each: "
            'record others, or say data.by = "block"'
        )
    sizes = [sum(end - begin for _, begin, end in group) for group in groups]
    ends = np.cumsum(sizes)
    parts: list[list[Range]] = []
    first = 0
    for index, share in enumerate(shares):
        later = sum(s > 0 for s in shares[index + 1 :])
        last = first
        if share:
            target = sum(shares[: index + 1]) * ends[-1]
            allowed = np.arange(first + 1, len(groups) - later + 1)
            last = int(allowed[np.argmin(np.abs(ends[allowed - 1] - target))])
        if share and not later:
            last = len(groups)
        parts.append([one for group in groups[first:last] for one in group])
        first = last
    return parts


def _joined(ranges: list[Range]) -> list[Range]:
    """Join ranges of a piece that follow each other."""
    joined: list[Range] = []
    for piece, begin, end in ranges:
        if joined and joined[-1][0] == piece and joined[-1][2] == begin:
            joined[-1] = (piece, joined[-1][1], end)
        else:
            joined.append((piece, begin, end))
    return joined
