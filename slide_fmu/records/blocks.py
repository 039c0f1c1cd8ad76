"""What divides prepared pieces, and into what: blocks of each part, as training and test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from slide_fmu.core.signals import Trajectory
from slide_fmu.records.measured import RecordError
from slide_fmu.records.preparation import Piece

SHARES = {"train": 0.7, "validation": 0.15, "test": 0.15}
"""The parts where nothing is said."""

By = Literal["block", "each", "record", "period"]


@dataclass(frozen=True)
class Splitting:
    """A Splitting says how pieces are divided.

    Attributes:
        lead: so many samples before the first one that is scored are only there to fill the
            window or to burn in; they may lie in the part before.
        by: by contiguous ``"block"`` in the order of time, of all records end to end or of
            ``"each"`` by itself; by whole ``"record"``; or by whole ``"period"``, of which those
            that are alike stay together.
        shares: what part of all samples each part has, by its name, in the order of time; 0 for
            none.
        period: length of the period in samples, where the split is by periods.

    Raises:
        RecordError: a number is out of range.
    """

    lead: int
    by: By = "block"
    shares: Mapping[str, float] = field(default_factory=lambda: dict(SHARES))
    period: int | None = None

    def __post_init__(self) -> None:
        shares = list(self.shares.values())
        if not shares or min(shares) < 0 or abs(sum(shares) - 1) > 1e-6 or not shares[0]:
            raise RecordError(
                f"shares = {dict(self.shares)}; expected numbers that are not negative and add to "
                "1, the first of them positive"
            )
        wrong = self.period is not None and self.period < 1
        if self.lead < 0 or wrong or (self.by == "period") != (self.period is not None):
            raise RecordError(
                f"lead = {self.lead}, by = {self.by!r}, period = {self.period}; expected a lead "
                "of at least 0, and a period of at least 1 sample with by = 'period' only"
            )


@dataclass(frozen=True)
class Block:
    """A Block is a range of one piece.

    It has the inputs from ``start`` to ``stop`` (excluded) of the piece's trajectory, and the
    outputs from ``start`` to ``stop`` (included). Scored are the outputs that follow the inputs
    from ``scored`` on: ``outputs[scored + 1]`` to ``outputs[stop]``.

    Attributes:
        piece: index of the piece.
        start, scored, stop: indices of inputs.
    """

    piece: int
    start: int
    scored: int
    stop: int

    def cut(self, pieces: Sequence[Piece]) -> Trajectory:
        """Give the block as a trajectory of its own; its lead has ``scored - start`` samples."""
        whole = pieces[self.piece].trajectory
        return Trajectory(
            whole.step,
            whole.inputs[self.start : self.stop],
            whole.outputs[self.start : self.stop + 1],
        )


Split = dict[str, tuple[Block, ...]]
"""The blocks of each part by its name, in the order of pieces. No sample is scored twice."""
