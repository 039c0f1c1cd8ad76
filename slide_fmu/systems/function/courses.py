"""The inputs of a whole motion are polynomials of the time, one in each interval.

An interval is a sample step, or a part of one between two jumps. So inputs that are held, move
evenly, bend or jump are one thing for an integrator that follows many motions at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Motion
from slide_fmu.systems.function.equations import through


@dataclass(frozen=True, eq=False)
class Intervals:
    """Intervals are consecutive ones of one motion, with the courses of its inputs in them.

    Attributes:
        durations: of the intervals in s, shape (K,).
        coefficients: of the powers of the time since an interval's beginning, in sample steps,
            lowest power first, shape (K, degree + 1, n_inputs).
        low, high: what the inputs stay within, (K, n_inputs) each.
        last: whether a sample step ends with the interval, shape (K,).
    """

    durations: FloatArray
    coefficients: FloatArray
    low: FloatArray
    high: FloatArray
    last: NDArray[np.bool_]

    def rates_at_ends(self, step: float) -> FloatArray:
        """Give the rates of the inputs at the ends of sample steps of a length in s, in 1/s.

        Their shape is (number of intervals that are the last ones of sample steps, n_inputs).
        """
        powers = np.arange(self.coefficients.shape[1], dtype=np.float64)
        slopes = powers[:, None] * self.coefficients[self.last] / step
        return np.asarray(slopes.sum(axis=1))


@dataclass(frozen=True, eq=False)
class Course:
    """A Course is the course of the inputs of one motion.

    Attributes:
        motion: its inputs, straight, bending or jumping.
        before: the inputs that acted before sample 0, (n_inputs,).
        step: sample step h in s.
        moves: whether inputs move between samples; otherwise they are held.
        ends: ranges of the inputs, shape (2, n_inputs): inputs that bend stay within them.
    """

    motion: Motion
    before: FloatArray
    step: float
    moves: bool
    ends: FloatArray

    @property
    def bends(self) -> bool:
        """Whether inputs bend between samples."""
        return self.motion.between is not None and self.motion.jumps is None

    @cached_property
    def degree(self) -> int:
        """The largest power of the time in the polynomials."""
        if self.motion.between is not None and self.bends:
            return len(self.motion.between) // len(self.motion.inputs)
        return int(self.moves)

    @cached_property
    def begins(self) -> tuple[NDArray[np.int64], FloatArray]:
        """The sample in which each interval lies, and the part of it where it begins, (K,)."""
        samples = np.arange(len(self.motion.inputs))
        jumps = self.motion.jumps
        if jumps is None or not np.isfinite(jumps).any():
            return samples, np.zeros(len(samples))
        inside = np.isfinite(jumps) & (jumps > 0.0) & (jumps < 1.0)
        at = np.concatenate([jumps[inside], np.zeros(len(samples))])
        sample = np.concatenate([np.nonzero(inside)[0], samples])
        pairs = np.unique(np.column_stack([sample, at]), axis=0)
        return pairs[:, 0].astype(np.int64), pairs[:, 1]

    def __len__(self) -> int:
        return len(self.begins[0])

    def intervals(self, first: int, end: int) -> Intervals:
        """Give the intervals ``first`` .. ``end`` - 1, each with as many powers as the degree."""
        samples, begins = (each[first:end] for each in self.begins)
        following = self.begins[0][end : end + 1] if end < len(self) else [-1]
        last = samples != np.append(samples[1:], following)
        until = np.append(begins[1:], self.begins[1][end : end + 1] if end < len(self) else 1.0)
        durations = self.step * np.where(last, 1.0, until) - self.step * begins
        inputs = self.motion.inputs
        reached = inputs[samples]
        before = np.where(samples[:, None] > 0, inputs[samples - 1], self.before)
        if self.motion.between is not None and self.bends:
            of_parts = self.degree * samples[:, None] + np.arange(self.degree)
            points = np.concatenate([before[:, None], self.motion.between[of_parts]], axis=1)
            low = np.minimum(self.ends[0], points.min(axis=1))
            high = np.maximum(self.ends[1], points.max(axis=1))
            return Intervals(durations, through(self.degree) @ points, low, high, last)
        if not self.moves:
            return Intervals(durations, reached[:, None], reached, reached, last)
        begin, change = before, reached - before
        if self.motion.jumps is not None:
            at = self.motion.jumps[samples]
            change = np.where(np.isnan(at), change, 0.0)
            begin = np.where(at <= begins[:, None], reached, before)  # NaN is not
            begin = begin + begins[:, None] * change
        low, high = np.minimum(before, reached), np.maximum(before, reached)
        return Intervals(durations, np.stack([begin, change], axis=1), low, high, last)
