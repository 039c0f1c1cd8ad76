"""Inputs as functions of time, from which an importer with any communication step sets its values.

Each function gives what the reference saw between its samples, so that an importer with a shorter
step sends nothing that the reference did not see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, final

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, cosines_of
from slide_fmu.cosim.between import interpolated
from slide_fmu.data.draws import Draw

SLACK = 1e-6
"""A time that differs by this part of a step from that of a sample is the time of the sample."""


class InputCourse(Protocol):
    """An InputCourse gives the inputs at any time."""

    def __call__(self, times: FloatArray) -> FloatArray:
        """Return the inputs at times in s, (N,), in their units, shape (N, n_inputs)."""


@final
@dataclass(frozen=True, eq=False)
class Stairs:
    """Stairs are constant over each step: ``rows[k]``, (n_inputs,), from k * step on.

    Attributes:
        step: in s.
        rows: shape (N, n_inputs).
    """

    step: float
    rows: FloatArray

    def __call__(self, times: FloatArray) -> FloatArray:
        place = np.floor(times / self.step + SLACK).astype(np.int64)
        return self.rows[np.clip(place, 0, len(self.rows) - 1)]


@final
@dataclass(frozen=True, eq=False)
class Lines:
    """Lines reach ``rows[k]`` at (k + 1) * step, and go straight from one to the next.

    Before the first of them the inputs are constant. An angle, which is given by cosine and sine,
    turns evenly.

    Attributes:
        step: in s.
        rows: shape (N, n_inputs).
        cosines: indices of the cosines of angles.
        curved: whether inputs follow a curve through these values where they are smooth.
    """

    step: float
    rows: FloatArray
    cosines: tuple[int, ...] = ()
    curved: bool = False

    def __call__(self, times: FloatArray) -> FloatArray:
        known = np.concatenate([self.rows[:1], self.rows])
        at_nodes = self.step * np.arange(len(known), dtype=np.float64)
        place = times / self.step
        sample = np.rint(place)  # a time that is a sample's but for rounding has its very values
        at = self.step * np.where(np.abs(place - sample) <= SLACK, sample, place)
        return interpolated(at_nodes, known, self.cosines, at, self.curved)


@final
@dataclass(frozen=True, eq=False)
class Jumps:
    """Inputs of which some jump within a step, and the others go straight.

    They are at ``rows[k]`` at (k + 1) * step. Before the first of them the inputs are constant.

    Attributes:
        step: in s.
        rows: shape (N, n_inputs).
        at: part of the step before each row after which its inputs jump to it, from 0 to 1; NaN
            for those that go straight. Shape (N, n_inputs).
    """

    step: float
    rows: FloatArray
    at: FloatArray

    def __call__(self, times: FloatArray) -> FloatArray:
        known = np.concatenate([self.rows[:1], self.rows])
        place = times / self.step
        step = np.clip(np.floor(place + SLACK), 0, len(self.rows) - 1).astype(np.int64)
        part = np.clip(place - step, 0.0, 1.0)[:, None]
        before, after, at = known[step], known[step + 1], self.at[step]
        straight = before + part * (after - before)
        return np.where(np.isnan(at), straight, np.where(part >= at - SLACK, after, before))


def course_of(drawn: Draw, signals: Sequence[Signal], step: float, planned: bool) -> InputCourse:
    """Return what the reference saw of drawn inputs between its samples.

    Planned motions move along curves through the samples, as their models move them.

    Args:
        drawn: the inputs.
        signals: the signals of the inputs.
        step: the sample step in s.
        planned: whether they are planned motions.
    """
    cosines = cosines_of(tuple(signals))
    if signals[0].hold == "zero_order":
        return Stairs(step, drawn.inputs)
    if drawn.jumps is not None:
        return Jumps(step, drawn.inputs, drawn.jumps)
    if drawn.between is not None:
        parts = len(drawn.between) // len(drawn.inputs)
        return Lines(step / parts, drawn.between, cosines)
    return Lines(step, drawn.inputs, cosines, curved=planned)
