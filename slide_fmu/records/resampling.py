"""This module resamples columns to even times and to another step, by filters of scipy."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly

from slide_fmu.core.held_means import held_means
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.records.clock import EVEN

LARGEST = 64
"""Largest denominator of a ratio of steps that counts as rational."""

LONGER = 1.01
"""A step is longer than another one if it is at least this multiple of it."""

EDGE = 10
"""This many new samples at either end are left out, where the filter reaches beyond the piece.

The filter of ``scipy.signal.resample_poly`` has 20 times the longer one of both steps.
"""

SMOOTH, FEWEST = 0.5, 8
"""An input is smooth if splines through every second sample miss the others by less than the first
part of what straight lines do; fewer samples tell nothing."""

Between = Literal["smooth"] | Hold
"""Interpolation of a column between its samples: an output is smooth, an input has a hold."""


@dataclass(frozen=True)
class Resampling:
    """A Resampling is a plan to bring a record to another step.

    Attributes:
        own: step of the record in s.
        step: new step in s.
        even: whether the times of the record are even.
        up, down: ratio of the polyphase filter; both 1 where nothing is filtered.
        base: step in s of the even samples that are filtered.
    """

    own: float
    step: float
    even: bool
    up: int = 1
    down: int = 1
    base: float = 0.0

    @property
    def needed(self) -> bool:
        """Tell whether the samples must change."""
        return not self.even or self.step != self.own

    @property
    def edge(self) -> int:
        """Number of new samples that are left out at either end."""
        return EDGE if self.down > 1 else 0


def plan_resampling(own: float, step: float, jitter: float, length: int) -> Resampling:
    """Choose how to resample from one step to another, both in s.

    Where the new step is longer, a polyphase filter removes frequencies that the new step cannot
    represent. It takes the samples as they are if they are even and the ratio is rational; else
    even samples are interpolated first, an integer number in each new step.

    Args:
        jitter: deviation of the times of the record from even ones, in steps.
        length: number of samples of the longest piece.
    """
    if abs(step / own - 1) * length < EVEN and jitter <= EVEN:
        return Resampling(step, step, even=True)
    if step <= LONGER * own:
        return Resampling(own, step, even=False)
    ratio = Fraction(step / own).limit_denominator(LARGEST)
    if jitter <= EVEN and abs(float(ratio) * own / step - 1) * length < EVEN:
        return Resampling(own, step, True, ratio.denominator, ratio.numerator, own)
    parts = ceil(step / own)
    return Resampling(own, step, False, 1, parts, step / parts)


def resampled(
    time: FloatArray, values: FloatArray, plan: Resampling, between: Between
) -> FloatArray:
    """Return columns at the times ``time[0] + (edge + k) step``, of one piece without gaps.

    A smooth column is interpolated by cubic splines, and so is an input with a first-order hold
    that moves smoothly: straight lines would make it smaller than it is. Else it is interpolated
    linearly. An input with a zero-order hold gets its mean until the next new sample. The number
    of new samples depends on the times alone.

    Args:
        time: times of the samples in s, shape (n,).
        values: shape (n, n_columns).
        plan: how the piece is resampled.
        between: interpolation of the columns between their samples.

    Returns:
        Shape (n_new, n_columns), which has no rows where the piece is too short.
    """
    if not plan.needed:
        return values
    count = _count(time, plan)
    if between == "zero_order":
        at = time[0] + plan.step * np.arange(count + 1)
        even = held_means(time, values, at)
    elif plan.down == 1:
        even = _interpolated(time, values, time[0] + plan.step * np.arange(count), between)
    else:
        at = np.arange(time[0], time[-1] + 1e-6 * plan.base, plan.base)
        base = values if plan.even else _interpolated(time, values, at, between)
        even = resample_poly(base, plan.up, plan.down, axis=0)[:count]
    return np.asarray(even[plan.edge : max(plan.edge, count - plan.edge)])


def _count(time: FloatArray, plan: Resampling) -> int:
    """Count the new samples from the first time to the last, both included."""
    duration = plan.own * (len(time) - 1) if plan.even else time[-1] - time[0]
    return 1 + floor(duration / plan.step + 1e-6)


def _interpolated(
    time: FloatArray, values: FloatArray, at: FloatArray, between: Between
) -> FloatArray:
    if between == "smooth" and len(time) > 3:
        return np.asarray(CubicSpline(time, values)(at))
    columns = [
        CubicSpline(time, one)(at) if moves_smoothly(time, one) else np.interp(at, time, one)
        for one in values.T
    ]
    return np.stack(columns, axis=1)


def moves_smoothly(time: FloatArray, values: FloatArray) -> bool:
    """Tell whether finite values, (N,), follow splines rather than straight lines in between."""
    if len(values) < FEWEST:
        return False
    left_out = np.arange(1, len(values) - 1, 2)
    ways = (
        CubicSpline(time[::2], values[::2])(time[left_out]),
        np.interp(time[left_out], time[::2], values[::2]),
    )
    spline, lines = (float(np.mean((way - values[left_out]) ** 2)) for way in ways)
    return spline < SMOOTH**2 * lines
