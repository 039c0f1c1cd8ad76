"""A linear program changes a move so that it keeps limits and has little vibration and jerk."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.route import Route
from slide_fmu.core.signals import FloatArray

USED = 0.9
"""Fraction of the tolerance that a linear program uses: the rest is for nonlinear effects."""

DEAR = 100.0
"""Cost of exceeding the tolerance, relative to the cost of the largest jerk all the time."""

CURVED = 0.99
"""Fraction of the limits that a linear program uses on a curve, where they are not linear."""


@dataclass(frozen=True, eq=False)
class LinearizedMoves:
    """A move is Linearized about the shares of its route at the samples before its end.

    Attributes:
        share: shares of the route, (end,).
        outputs: relative to rest, from the end on, (rows, n_outputs).
        slopes: their derivatives by the shares, (end, rows, n_outputs).
    """

    share: FloatArray
    outputs: FloatArray
    slopes: FloatArray


def change(
    move: LinearizedMoves, route: Route, limits: Limits, step: float, allowed: float, reach: float
) -> tuple[FloatArray, float] | None:
    """Solve the linear program; None if the limits cannot be kept.

    It returns changes of the shares, (end,), and the largest excess above the allowed value,
    relative to it. Unknowns are the changes, then limits of the jerks (end + 3), then that excess.

    Args:
        move: the move to change.
        route: the route of its shares.
        limits: limits of the result.
        step: time between samples, in s.
        allowed: deviation of the outputs from rest, in their unit, as a norm.
        reach: largest change of a share.
    """
    end = len(move.share)
    jerks = end + 3
    slopes, now = _reached(move, allowed, reach)
    rows, excess = sparse.csr_array(slopes), sparse.csr_array(np.full((len(now), 1), -1.0))
    above: list[list[Any]] = [[rows, None, excess], [-rows, None, excess]]
    bounds = [1 - now, 1 + now]
    for matrix, current in _limited(move.share, route, limits, step):
        above += [[matrix, None, None], [-matrix, None, None]]
        # if more is used already, the use must not grow
        most = 1.0 if route.straight else np.maximum(CURVED, np.abs(current))
        bounds += [most - current, most + current]
    matrix, current = _differences(move.share, 1.0, 3)
    scale, each = np.abs(current).max() or 1.0, sparse.eye_array(jerks)
    above += [[matrix / scale, -each, None], [-matrix / scale, -each, None]]
    bounds += [-current / scale, current / scale]
    cost = np.concatenate([np.zeros(end), np.full(jerks, 1 / jerks), [DEAR]])
    first, last = _range_of_share(route, limits)
    box = np.tile([0.0, np.inf], (len(cost), 1))
    box[:end, 0] = np.maximum(-reach, np.minimum(first - move.share, 0.0))
    box[:end, 1] = np.minimum(reach, np.maximum(last - move.share, 0.0))
    matrix, bound = sparse.block_array(above, format="csc"), np.concatenate(bounds)
    solved = linprog(cost, matrix, bound, bounds=box, method="highs")
    return None if solved.x is None else (np.asarray(solved.x[:end]), float(solved.x[-1]))


def _reached(move: LinearizedMoves, allowed: float, reach: float) -> tuple[FloatArray, FloatArray]:
    """Return slopes, (n, end), and values of the outputs that can reach the allowed deviation.

    Both are relative to it.
    """
    # a box within the allowed ball: its corners touch it
    each = USED * allowed / np.sqrt(move.outputs.shape[1])
    rows = move.slopes.reshape(len(move.share), -1).T / each
    now = move.outputs.reshape(-1) / each
    reached = np.abs(now) + reach * np.abs(rows).sum(axis=1) > 1  # others cannot reach it
    return rows[reached], now[reached]


def _limited(
    share: FloatArray, route: Route, limits: Limits, step: float
) -> list[tuple[Any, FloatArray]]:
    """Return matrices from changes to the used fractions of all limits, and the present use."""
    found = []
    gone, slopes = route.at(share) - route.start, route.slopes(share)
    for _, order, limit in limits.derivatives():
        for one in route.binding(limit):
            most = limit[one] * step**order
            whole = float(route.goal[one] - route.start[one])
            matrix, current = _differences(gone[:, one], whole, order)
            found.append((matrix * (slopes[:, one] / most), current / most))
    return found


def _range_of_share(route: Route, limits: Limits) -> tuple[float, float]:
    """Return the least and the largest share at which all coordinates are within their ranges."""
    if not route.straight:
        return 0.0, 1.0
    change = route.goal - route.start
    moved = change != 0
    ends = np.stack([limits.low, limits.high]) - route.start
    least, most = np.sort(ends[:, moved] / change[moved], axis=0)
    return float(least.max()), float(most.min())


def _differences(values: FloatArray, last: float, order: int) -> tuple[Any, FloatArray]:
    """Return differences of values (end,) that rest at 0 before, and at the last value after.

    These are a matrix, (end + order, end), for their changes, and the present ones, (end +
    order,).
    """
    resting = np.concatenate([np.zeros(order), values, np.full(order, last)])
    parts = [(-1.0) ** (order - k) * comb(order, k) for k in range(order + 1)]
    shape = (len(values) + order, len(values))
    matrix = sparse.diags_array(parts, offsets=np.arange(order + 1) - order, shape=shape)
    return matrix, np.diff(resting, n=order)
