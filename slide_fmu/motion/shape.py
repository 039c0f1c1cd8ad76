"""A motion of a given duration that leaves no more than is allowed, by linear programs.

The way is free at every sample, and all coordinates share it. A linear program keeps the limits
and the linearized response after the end below what the tolerance leaves, and jerks no more than
that needs; without this an optimiser lives off the surrogate's errors. The response is linearized
again about its result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from slide_fmu.core.signals import FloatArray
from slide_fmu.motion.limits import Limits
from slide_fmu.motion.response import Response

REACHES = (0.1, 0.02, 0.005)
"""In so many rounds the response is linearized; none changes a sample of the way by more than this
share of it, so that they come to an end."""

PROBE = 1e-4
"""Responses are differentiated by changes of this share of the way, forwards."""

USED = 0.9
"""A linear program plans with this part of the tolerance: the rest is for what is not linear."""

HOPELESS = 1.0
"""A duration whose linear program exceeds what is allowed by this part of it is given up."""

DEAR = 100.0
"""What is above the tolerance costs so many times what jerking all the time does."""


@dataclass(frozen=True, eq=False)
class Planned:
    """A Planned motion ends at a sample.

    Attributes:
        motion: coordinates, (count, n_coordinates).
        end: the sample from which on it stays at the goal.
        largest: largest deviation from rest after it, as predicted, in the outputs' unit.
    """

    motion: FloatArray
    end: int
    largest: float


def shape(
    response: Response, limits: Limits, start: FloatArray, end: int, allowed: float
) -> Planned:
    """Shape a motion so that it leaves less than what is allowed; the best of all rounds.

    Args:
        response: answers motions.
        limits: that the result keeps, if a motion from point to point can.
        start: the motion to begin with, (count, n_coordinates); its coordinates share one way.
        end: sample from which on the result stays at the goal.
        allowed: deviation of the outputs from rest, in their unit, as a norm.
    """
    if end == 0:  # it jumps: nothing is free
        return Planned(start, end, np.inf)
    share = _way_of(response, start)
    best: Planned | None = None
    for reach in REACHES:
        outputs, slopes = _linearized(response, share, end)
        solved = _program(response, limits, share[:end], outputs, slopes, allowed, reach)
        if solved is None:
            break
        change, excess = solved
        share = share.copy()
        share[:end] += change
        share[end:] = 1.0
        motion = _motion_of(response, share)
        after = np.linalg.norm(response.outputs(motion[None])[0, end:], axis=1)
        found = Planned(motion, end, float(after.max()))
        if best is None or found.largest < best.largest:
            best = found
        if best.largest <= allowed or excess > HOPELESS:
            break
    if best is None:  # no motion of this duration keeps the limits
        return Planned(start, end, np.inf)
    return best


def _way_of(response: Response, motion: FloatArray) -> FloatArray:
    """Give the way 0 .. 1 of a motion whose coordinates share it, (count,)."""
    way = response.goal - response.start
    longest = int(np.argmax(np.abs(way)))
    return np.asarray((motion[:, longest] - response.start[longest]) / way[longest])


def _motion_of(response: Response, share: FloatArray) -> FloatArray:
    """Give motions, (..., count, n_coordinates), from ways, (..., count)."""
    return response.start + share[..., None] * (response.goal - response.start)


def _linearized(response: Response, share: FloatArray, end: int) -> tuple[FloatArray, FloatArray]:
    """Outputs after the end, (rows, n_outputs), and their slopes by the samples before it.

    The slopes have the shape (end, rows, n_outputs).
    """
    ended = np.where(np.arange(response.count) < end, share, 1.0)
    probes = np.tile(ended, (end + 1, 1))
    probes[np.arange(1, end + 1), np.arange(end)] += PROBE
    outputs = response.outputs(_motion_of(response, probes))[:, end:]
    return outputs[0], (outputs[1:] - outputs[0]) / PROBE


def _program(
    response: Response,
    limits: Limits,
    share: FloatArray,
    outputs: FloatArray,
    slopes: FloatArray,
    allowed: float,
    reach: float,
) -> tuple[FloatArray, float] | None:
    """Solve the linear program; None if the limits cannot be kept.

    It gives changes of the way, (end,), and the largest excess above what is allowed, relative to
    it. Unknowns are the changes, then what the jerks are at most (end + 3), then that excess.
    """
    end, jerks = len(share), len(share) + 3
    # a box within the ball of what is allowed: its corners are as far away as that
    each = USED * allowed / np.sqrt(outputs.shape[1])
    rows = slopes.reshape(end, -1).T / each
    now = outputs.reshape(-1) / each
    reached = np.abs(now) + reach * np.abs(rows).sum(axis=1) > 1  # others cannot get there
    rows, now = rows[reached], now[reached]
    above, below, bounds = [], [], []

    def add(changes: FloatArray, jerk: FloatArray, excess: float, bound: FloatArray) -> None:
        above.append(changes)
        below.append(np.hstack([jerk, np.full((len(changes), 1), -excess)]))
        bounds.append(bound)

    none = np.zeros((len(rows), jerks))
    add(rows, none, 1.0, 1 - now)
    add(-rows, none, 1.0, 1 + now)
    way = np.abs(response.goal - response.start)
    for _, order, limit in limits.derivatives():
        used = float(np.max(way / limit)) / response.step**order
        if used == 0:
            continue
        matrix, current = _differences(share, order)
        free = np.zeros((len(matrix), jerks))
        add(used * matrix, free, 0.0, 1 - used * current)
        add(-used * matrix, free, 0.0, 1 + used * current)
    matrix, current = _differences(share, 3)
    scale = np.abs(current).max() or 1.0
    add(matrix / scale, -np.eye(jerks), 0.0, -current / scale)
    add(-matrix / scale, -np.eye(jerks), 0.0, current / scale)
    cost = np.concatenate([np.zeros(end), np.full(jerks, 1 / jerks), [DEAR]])
    least, most = _range_of_way(response, limits)
    changes = zip(
        np.maximum(-reach, np.minimum(least - share, 0.0)),
        np.minimum(reach, np.maximum(most - share, 0.0)),
        strict=True,
    )
    box = [*changes, *[(0.0, None)] * (jerks + 1)]
    both = np.hstack([np.concatenate(above), np.concatenate(below)])
    solved = linprog(cost, both, np.concatenate(bounds), bounds=box, method="highs")
    return None if solved.x is None else (np.asarray(solved.x[:end]), float(solved.x[-1]))


def _range_of_way(response: Response, limits: Limits) -> tuple[float, float]:
    """Give the least and the largest way at which all coordinates are within their ranges."""
    way = response.goal - response.start
    moved = way != 0
    ends = np.stack([limits.low, limits.high]) - response.start
    least, most = np.sort(ends[:, moved] / way[moved], axis=0)
    return float(least.max()), float(most.min())


def _differences(share: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Differences of a way between its rests: a matrix for its changes, and what they are now.

    Shapes (end + order, end) and (end + order,).
    """
    resting = np.concatenate([np.zeros(order), share, np.ones(order)])
    matrix = np.diff(np.eye(len(resting)), n=order, axis=0)
    return matrix[:, order : order + len(share)], np.asarray(matrix @ resting)
