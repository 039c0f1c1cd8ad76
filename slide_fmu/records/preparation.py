"""From records to even trajectories: resampled, and cut where samples are missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slide_fmu.core.signals import FloatArray, Hold, Trajectory
from slide_fmu.record_files.record import GIVE_STEP, Record, RecordError
from slide_fmu.records.clock import Clock, clock_of_record, neat_step
from slide_fmu.records.resampling import LONGER, Resampling, plan_resampling, resampled

Pairing = Literal["same", "later"]
"""Which output answers an input, of samples u[k] and y[k] that were measured together.

``same``: y[k] depends on the inputs up to u[k], as where both move between samples, or where the
output answers at once. ``later``: y[k] depends on those up to u[k-1] only, as where u[k] is set
at t_k and held until t_k+1.
"""


@dataclass(frozen=True)
class Preparation:
    """A Preparation is what shall be made of records.

    Attributes:
        inputs, outputs: columns, in channel order.
        step: sample step of the trajectories in s; that of the first record if None.
        hold: what the inputs do between samples.
        pairing: which output answers an input.
        least: stretches of fewer samples are left out.

    Raises:
        RecordError: a column is missing or named twice, or a number is out of range.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    step: float | None = None
    hold: Hold = "first_order"
    pairing: Pairing = "same"
    least: int = 2

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
    """A Piece is a stretch of a record without gaps, as a trajectory; outputs may lack, as NaN.

    Of N measured samples, ``trajectory`` has N outputs and N - 1 inputs: ``outputs[k]`` is y[k],
    and ``inputs[k]`` is the newest input that y[k+1] answers, which is u[k+1] if they are paired
    as ``same``, and u[k] if ``later``.

    Attributes:
        trajectory: inputs (N - 1, n_inputs), outputs (N, n_outputs), in the record's units.
        record: index of the record.
        start: time of the first output in the record, in s.
    """

    trajectory: Trajectory
    record: int
    start: float


@dataclass(frozen=True, eq=False)
class Prepared:
    """Prepared is what was made of records: pieces in their order, and remarks on what was done.

    Attributes:
        pieces: at least one; all have the same step.
        remarks: one sentence for each thing that was done, for people.
    """

    pieces: tuple[Piece, ...]
    remarks: tuple[str, ...]


def prepared(records: Sequence[Record], preparation: Preparation) -> Prepared:
    """Make trajectories of one even step from records.

    A record is cut at its gaps, and where an input has no finite value. Outputs that are missing
    are NaN, but a record that is resampled is cut there too, since nothing is invented.

    Raises:
        RecordError: a record lacks a column, its time does not rise, or no stretch is left.
    """
    clocks = [_sound_clock(record) for record in records]
    step = preparation.step or neat_step(clocks[0], clocks[0].longest(len(records[0].time)))
    pieces: list[Piece] = []
    remarks: list[str] = []
    for index, (record, clock) in enumerate(zip(records, clocks, strict=True)):
        length = clock.longest(len(record.time))
        plan = plan_resampling(clock.step, step, clock.jitter, length)
        remarks += _about_resampling(record, plan, preparation.hold)
        needed = (*preparation.inputs, *(preparation.outputs if plan.needed else ()))
        stretches = stretches_of(record, clock, needed)
        found = [_piece(record, index, s, plan, preparation) for s in stretches]
        kept = [piece for piece in found if piece is not None]
        if len(stretches) > 1 or len(kept) < len(stretches):
            left_out = len(stretches) - len(kept)
            remarks.append(
                f"{record.path}: cut into {len(stretches)} stretches where samples are missing; "
                f"{left_out} of them have fewer than {preparation.least} samples and are left out"
            )
        pieces += kept
    if not pieces:
        raise RecordError(
            f"{records[0].path}: no stretch without gaps has {preparation.least} samples of step "
            f"{step:.6g} s; expected at least one: record without gaps, or ask for fewer samples"
        )
    return Prepared(tuple(pieces), tuple(remarks))


def _sound_clock(record: Record) -> Clock:
    clock = clock_of_record(record)
    wrong = sorted((*clock.falls, *clock.repeats))
    if wrong:
        raise RecordError(
            f"{record.path}: the time does not rise at {record.place(wrong[0])}; expected times "
            f"that rise: cut the file there into several records, or {GIVE_STEP}"
        )
    return clock


def stretches_of(record: Record, clock: Clock, names: tuple[str, ...]) -> list[tuple[int, int]]:
    """Give begin and end (excluded) of stretches without gaps in time or named columns."""
    values = record.chosen(names)
    usable = np.asarray(np.isfinite(values).all(axis=1))
    found = []
    for begin, end in clock.stretches(len(usable)):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], usable[begin:end], [False]])))
        found += [(begin + int(a), begin + int(b)) for a, b in edges.reshape(-1, 2)]
    return found


def longest_stretch(
    record: Record, inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Give inputs and outputs of the longest stretch, (n, n_inputs) and (n, n_outputs).

    They are as they were measured; there are none where no sample is whole.

    Raises:
        RecordError: a column is missing, or no time rises.
    """
    stretches = stretches_of(record, clock_of_record(record), (*inputs, *outputs))
    begin, end = max(stretches, key=lambda stretch: stretch[1] - stretch[0], default=(0, 0))
    return record.chosen(inputs)[begin:end], record.chosen(outputs)[begin:end]


def _piece(
    record: Record,
    index: int,
    stretch: tuple[int, int],
    plan: Resampling,
    preparation: Preparation,
) -> Piece | None:
    """Make a trajectory of a stretch; None if it is too short."""
    rows = slice(*stretch)
    time = record.time[rows]
    inputs = resampled(time, record.chosen(preparation.inputs)[rows], plan, preparation.hold)
    outputs = resampled(time, record.chosen(preparation.outputs)[rows], plan, "smooth")
    if len(outputs) < preparation.least:
        return None
    outputs = np.where(np.isfinite(outputs), outputs, np.nan)
    start = float(time[0]) + plan.edge * plan.step
    return Piece(_paired(inputs, outputs, plan.step, preparation.pairing), index, start)


def _paired(inputs: FloatArray, outputs: FloatArray, step: float, pairing: Pairing) -> Trajectory:
    """Pair N inputs and N outputs that were measured together; one input is left over."""
    return Trajectory(step, inputs[1:] if pairing == "same" else inputs[:-1], outputs)


def _about_resampling(record: Record, plan: Resampling, hold: Hold) -> list[str]:
    """Say how a record is resampled, if it is."""
    if not plan.needed:
        return []
    means = "; held inputs are averaged over each step" if hold == "zero_order" else ""
    if plan.down > 1:
        how = f"the polyphase filter {plan.up}/{plan.down} of scipy against aliasing"
        if not plan.even:
            how = f"splines to even times of {plan.base:.6g} s and by {how}"
        how += f", without {plan.edge} samples at either end of each stretch"
    else:
        lines = "straight lines for inputs" if hold == "first_order" else "means for inputs"
        how = f"cubic splines for outputs and {lines}"
        if LONGER * plan.step < plan.own:
            how += "; nothing is known between the measured samples"
    return [f"{record.path}: resampled from {plan.own:.6g} s to {plan.step:.6g} s by {how}{means}"]
