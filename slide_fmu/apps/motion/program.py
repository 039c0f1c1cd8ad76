"""The linear program that changes a move: it keeps limits, rings little, and jerks little."""

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
"""A linear program plans with this part of the tolerance: the rest is for what is not linear."""

DEAR = 100.0
"""What is above the tolerance costs so many times what jerking all the time does."""

CURVED = 0.99
"""On a curve limits are not linear: a linear program plans with this part of them."""


@dataclass(frozen=True, eq=False)
class Linearized:
    """A move is Linearized about the shares of its route at the samples before its end.

    Attributes:
        share: of the route, (end,).
        outputs: about rest, from the end on, (rows, n_outputs).
        slopes: of these by the shares, (end, rows, n_outputs).
    """

    share: FloatArray
    outputs: FloatArray
    slopes: FloatArray


def change(
    move: Linearized, route: Route, limits: Limits, step: float, allowed: float, reach: float
) -> tuple[FloatArray, float] | None:
    """Solve the linear program; None if the limits cannot be kept.

    It gives changes of the shares, (end,), and the largest excess above what is allowed, relative
    to it. Unknowns are the changes, then what the jerks are at most (end + 3), then that excess.

    Args:
        move: what is changed.
        route: what its shares are of.
        limits: that the result keeps.
        step: time between samples, in s.
        allowed: deviation of the outputs from rest, in their unit, as a norm.
        reach: no share changes by more.
    """
    end = len(move.share)
    jerks = end + 3
    slopes, now = _reached(move, allowed, reach)
    rows, excess = sparse.csr_array(slopes), sparse.csr_array(np.full((len(now), 1), -1.0))
    above: list[list[Any]] = [[rows, None, excess], [-rows, None, excess]]
    bounds = [1 - now, 1 + now]
    for matrix, current in _limited(move.share, route, limits, step):
        above += [[matrix, None, None], [-matrix, None, None]]
        # where more is used already, no more than that may be
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


def _reached(move: Linearized, allowed: float, reach: float) -> tuple[FloatArray, FloatArray]:
    """Give slopes, (n, end), and values of the outputs that changes may bring to what is allowed.

    Both are relative to that.
    """
    # a box within the ball of what is allowed: its corners are as far away as that
    each = USED * allowed / np.sqrt(move.outputs.shape[1])
    rows = move.slopes.reshape(len(move.share), -1).T / each
    now = move.outputs.reshape(-1) / each
    reached = np.abs(now) + reach * np.abs(rows).sum(axis=1) > 1  # others cannot get there
    return rows[reached], now[reached]


def _limited(
    share: FloatArray, route: Route, limits: Limits, step: float
) -> list[tuple[Any, FloatArray]]:
    """Give matrices from changes to the used parts of all limits, and what is used now."""
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
    """Give the least and the largest share at which all coordinates are within their ranges."""
    if not route.straight:
        return 0.0, 1.0
    change = route.goal - route.start
    moved = change != 0
    ends = np.stack([limits.low, limits.high]) - route.start
    least, most = np.sort(ends[:, moved] / change[moved], axis=0)
    return float(least.max()), float(most.min())


def _differences(values: FloatArray, last: float, order: int) -> tuple[Any, FloatArray]:
    """Differences of values (end,) that rest at 0 before, and at the last one after.

    A matrix, (end + order, end), for their changes, and what they are now, (end + order,).
    """
    resting = np.concatenate([np.zeros(order), values, np.full(order, last)])
    parts = [(-1.0) ** (order - k) * comb(order, k) for k in range(order + 1)]
    shape = (len(values) + order, len(values))
    matrix = sparse.diags_array(parts, offsets=np.arange(order + 1) - order, shape=shape)
    return matrix, np.diff(resting, n=order)
