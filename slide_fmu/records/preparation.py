"""This module makes even trajectories of records: resampled, and cut at missing samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slide_fmu.core.signals import FloatArray, Hold, Trajectory
from slide_fmu.record_files.record import GIVE_STEP, Record, RecordError, files_named
from slide_fmu.records.clock import Clock, clock_of_record, neat_step
from slide_fmu.records.resampling import LONGER, Resampling, plan_resampling, resampled
from slide_fmu.records.rest import begins_at_rest, begins_in_motion, resting_samples

Pairing = Literal["same", "later"]
"""The pairing names the output that answers an input, of samples u[k], y[k] measured together.

``same``: y[k] depends on the inputs up to u[k], for example if both move between samples, or if
the output answers at once. ``later``: y[k] depends on the inputs up to u[k-1] only, for example if
u[k] is set at t_k and held until t_k+1.
"""


@dataclass(frozen=True)
class Preparation:
    """A Preparation holds the settings with which trajectories are made of records.

    Attributes:
        inputs, outputs: columns, in channel order.
        step: sample step of the trajectories in s; the step of the first record if None.
        hold: hold of the inputs between samples.
        pairing: the output that answers an input.
        least: pieces with fewer samples are left out.
        rest: whether files begin at rest; a piece behind a gap does so where it shows it.

    Raises:
        RecordError: a column is missing or named twice, or a number is out of range.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    step: float | None = None
    hold: Hold = "first_order"
    pairing: Pairing = "same"
    least: int = 2
    rest: bool = False

    def __post_init__(self) -> None:
        names = (*self.inputs, *self.outputs)
        if not self.inputs or not self.outputs or len(set(names)) < len(names):
            raise RecordError(
                f"inputs {list(self.inputs)}, outputs {list(self.outputs)}; expected at least one "
                "of each, and no column twice"
            )
        if self.least < 2 or not (self.step is None or 0 < self.step < np.inf):
            raise RecordError(
                f"least = {self.least} samples, step = {self.step} s; expected at least 2, and a "
                "positive, finite step"
            )


@dataclass(frozen=True, eq=False)
class Piece:
    """A Piece is a gap-free part of a record, as a trajectory; missing outputs are NaN.

    Of N measured samples, ``trajectory`` has N outputs and N - 1 inputs: ``outputs[k]`` is y[k],
    and ``inputs[k]`` is the newest input that y[k+1] answers, which is u[k+1] with the pairing
    ``same``, and u[k] with ``later``.

    Attributes:
        trajectory: inputs (N - 1, n_inputs), outputs (N, n_outputs), in the record's units.
        record: index of the record.
        start: time of the first output in the record, in s.
        rest: inputs before it, (n_inputs,), if it begins at rest, so that its first outputs were
            there before; None if it may begin in motion.
    """

    trajectory: Trajectory
    record: int
    start: float
    rest: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class PreparedRecords:
    """PreparedRecords hold the pieces of records in their order, and remarks on their preparation.

    Attributes:
        pieces: at least one; all have the same step.
        remarks: one sentence for each cut or resampling, for people.
    """

    pieces: tuple[Piece, ...]
    remarks: tuple[str, ...]


def prepared(records: Sequence[Record], preparation: Preparation) -> PreparedRecords:
    """Make trajectories of one even step from records.

    A record is cut at its gaps, and where an input has no finite value. Missing outputs are NaN;
    a record that is resampled is cut there too, since missing values are not interpolated.

    Raises:
        RecordError: a record lacks a column, its time does not rise, no piece is left, or a record
            that shall begin at rest does not.
    """
    clocks = [_sound_clock(record) for record in records]
    step = preparation.step or neat_step(clocks[0], clocks[0].longest(len(records[0].time)))
    pieces: list[Piece] = []
    resampling: dict[str, list[str]] = {}
    cuts: list[tuple[str, int, int]] = []
    for index, (record, clock) in enumerate(zip(records, clocks, strict=True)):
        length = clock.longest(len(record.time))
        plan = plan_resampling(clock.step, step, clock.jitter, length)
        for how in _about_resampling(plan, preparation.hold):
            resampling.setdefault(how, []).append(record.path)
        needed = (*preparation.inputs, *(preparation.outputs if plan.needed else ()))
        ranges = gap_free_ranges(record, clock, needed)
        cut = [_piece(record, index, s, plan, preparation) for s in ranges]
        kept = [piece for piece in cut if piece is not None]
        if len(ranges) > 1 or len(kept) < len(ranges):
            cuts.append((record.path, len(ranges), len(ranges) - len(kept)))
        pieces += kept
    if not pieces:
        raise RecordError(
            f"{records[0].path}: no piece without gaps has {preparation.least} samples of step "
            f"{step:.6g} s; expected at least one: record without gaps, or ask for fewer samples"
        )
    remarks = [f"{files_named(paths)}: {how}" for how, paths in resampling.items()]
    remarks += _about_cuts(cuts, preparation.least)
    return PreparedRecords(tuple(pieces), tuple(remarks))


def _about_cuts(cuts: Sequence[tuple[str, int, int]], least: int) -> list[str]:
    """Return one remark on the files that are cut: path, pieces, and how many are left out."""
    if not cuts:
        return []
    paths, pieces, left_out = zip(*cuts, strict=True)
    return [
        f"{files_named(paths)}: cut into {sum(pieces)} pieces where samples are missing; "
        f"{sum(left_out)} of them have fewer than {least} samples and are left out"
    ]


def _sound_clock(record: Record) -> Clock:
    clock = clock_of_record(record)
    wrong = sorted((*clock.falls, *clock.repeats))
    if wrong:
        raise RecordError(
            f"{record.path}: the time does not rise at {record.place(wrong[0])}; expected times "
            f"that rise: cut the file there into several records, or {GIVE_STEP}"
        )
    return clock


def gap_free_ranges(record: Record, clock: Clock, names: tuple[str, ...]) -> list[tuple[int, int]]:
    """Return begin and end (excluded) of ranges without gaps in time or named columns."""
    values = record.chosen(names)
    usable = np.asarray(np.isfinite(values).all(axis=1))
    free = []
    for begin, end in clock.pieces(len(usable)):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], usable[begin:end], [False]])))
        free += [(begin + int(a), begin + int(b)) for a, b in edges.reshape(-1, 2)]
    return free


def longest_piece(
    record: Record, inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return inputs and outputs of the longest gap-free range, (n, n_inputs), (n, n_outputs).

    They are as they were measured; n is 0 if no sample has all values.

    Raises:
        RecordError: a column is missing, or no time rises.
    """
    ranges = gap_free_ranges(record, clock_of_record(record), (*inputs, *outputs))
    begin, end = max(ranges, key=lambda ends: ends[1] - ends[0], default=(0, 0))
    return record.chosen(inputs)[begin:end], record.chosen(outputs)[begin:end]


def _piece(
    record: Record,
    index: int,
    ends: tuple[int, int],
    plan: Resampling,
    preparation: Preparation,
) -> Piece | None:
    """Make a trajectory of a range of samples; None if it is too short."""
    rows = slice(*ends)
    time = record.time[rows]
    inputs = resampled(time, record.chosen(preparation.inputs)[rows], plan, preparation.hold)
    outputs = resampled(time, record.chosen(preparation.outputs)[rows], plan, "smooth")
    if len(outputs) < preparation.least:
        return None
    outputs = np.where(np.isfinite(outputs), outputs, np.nan)
    start = float(time[0]) + plan.edge * plan.step
    at_rest = preparation.rest and _is_at_rest(record, ends[0] == 0, inputs, outputs)
    paired = _paired(inputs, outputs, plan.step, preparation.pairing)
    return Piece(paired, index, start, inputs[0] if at_rest else None)


def _is_at_rest(record: Record, first: bool, inputs: FloatArray, outputs: FloatArray) -> bool:
    """Tell whether a piece begins at rest: the first one of a file, if it does not show otherwise.

    Raises:
        RecordError: a file begins in motion.
    """
    if not first:
        return begins_at_rest(inputs, outputs)
    if begins_in_motion(inputs, outputs):
        raise RecordError(
            f"{record.path}: outputs move in the first {resting_samples(inputs)} samples, before "
            'the inputs do; expected outputs at rest, since the recipe says start = "rest" '
            "(system.parameters): remove this key, or let the file begin later or earlier"
        )
    return True


def _paired(inputs: FloatArray, outputs: FloatArray, step: float, pairing: Pairing) -> Trajectory:
    """Pair N inputs and N outputs that were measured together; one input is left over."""
    return Trajectory(step, inputs[1:] if pairing == "same" else inputs[:-1], outputs)


def _about_resampling(plan: Resampling, hold: Hold) -> list[str]:
    """Say how a record is resampled, if it is."""
    if not plan.needed:
        return []
    means = "; held inputs are averaged over each step" if hold == "zero_order" else ""
    if plan.down > 1:
        how = f"the polyphase filter {plan.up}/{plan.down} of scipy against aliasing"
        if not plan.even:
            how = f"splines to even times of {plan.base:.6g} s and by {how}"
        how += f", without {plan.edge} samples at either end of each piece"
    else:
        how = "cubic splines for outputs and means for inputs"
        if hold == "first_order":
            how = (
                "cubic splines for outputs and smooth inputs, and straight lines for other inputs"
            )
        if LONGER * plan.step < plan.own:
            how += "; nothing is known between the measured samples"
    return [f"resampled from {plan.own:.4g} s to {plan.step:.6g} s by {how}{means}"]
