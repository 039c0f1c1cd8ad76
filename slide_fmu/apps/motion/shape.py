"""A motion of a given duration with an allowed residual is found by linear programs.

The route is free at every sample. All coordinates share it, or each one has its own time law. A
linear program keeps the limits, keeps the linearized response after the end below the allowed
value, and uses no more jerk than that needs; without the last condition an optimiser exploits the
surrogate's errors. The response is linearized again about each result.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.response import Response
from slide_fmu.apps.motion.route import Route
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.base import batches

USED = 0.9
"""Fraction of the tolerance that a linear program uses: the rest is for nonlinear effects."""

DEAR = 100.0
"""Cost of exceeding the tolerance, relative to the cost of the largest jerk all the time."""

CURVED = 0.99
"""Fraction of the limits that a linear program uses on a curve, where they are not linear."""


@dataclass(frozen=True, eq=False)
class LinearizedMoves:
    """LinearizedMoves are moves about the shares of its route at the samples before its end.

    Attributes:
        share: shares of the route, (end, n): one for all coordinates, or one for each that moves.
        outputs: relative to rest, from the end on, (rows, n_outputs).
        slopes: their derivatives by the shares, (end * n, rows, n_outputs).
    """

    share: FloatArray
    outputs: FloatArray
    slopes: FloatArray

    def column(self, index: int) -> Any:
        """Return the matrix from changes of all shares, (end * n,), to a column, (end,)."""
        end, n = self.share.shape
        places = np.arange(end), np.arange(end) * n + index
        return sparse.csr_array((np.ones(end), places), shape=(end, end * n))


def change(
    move: LinearizedMoves, route: Route, limits: Limits, step: float, allowed: float, reach: float
) -> tuple[FloatArray, float] | None:
    """Solve the linear program; None if the limits cannot be kept.

    It returns changes of the shares, (end, n), and the largest excess above the allowed value,
    relative to it. Unknowns are the changes, then limits of the jerks (end + 3 of each column),
    then that excess.

    Args:
        move: the move to change.
        route: the route of its shares.
        limits: limits of the result.
        step: time between samples, in s.
        allowed: deviation of the outputs from rest, in their unit, as a norm.
        reach: largest change of a share.
    """
    end, columns = move.share.shape
    jerks = columns * (end + 3)
    slopes, now = _reached(move, allowed, reach)
    rows, excess = sparse.csr_array(slopes), sparse.csr_array(np.full((len(now), 1), -1.0))
    above: list[list[Any]] = [[rows, None, excess], [-rows, None, excess]]
    bounds = [1 - now, 1 + now]
    for matrix, current in _limited(move, route, limits, step):
        above += [[matrix, None, None], [-matrix, None, None]]
        # if more is used already, the use must not grow
        most = 1.0 if route.straight else np.maximum(CURVED, np.abs(current))
        bounds += [most - current, most + current]
    jerk, current = _jerks(move)
    each = sparse.eye_array(jerks)
    above += [[jerk, -each, None], [-jerk, -each, None]]
    bounds += [-current, current]
    cost = np.concatenate([np.zeros(move.share.size), np.full(jerks, 1 / jerks), [DEAR]])
    first, last = _range_of_shares(route, limits, columns)
    box = np.tile([0.0, np.inf], (len(cost), 1))
    low = np.maximum(-reach, np.minimum(first - move.share, 0.0))
    high = np.minimum(reach, np.maximum(last - move.share, 0.0))
    box[: move.share.size] = np.stack([low.ravel(), high.ravel()], axis=1)
    matrix, bound = sparse.block_array(above, format="csc"), np.concatenate(bounds)
    method = "highs" if columns == 1 else "highs-ipm"  # which is faster for large programs
    solved = linprog(cost, matrix, bound, bounds=box, method=method)
    if solved.x is None:
        return None
    return np.asarray(solved.x[: move.share.size]).reshape(end, columns), float(solved.x[-1])


def _reached(move: LinearizedMoves, allowed: float, reach: float) -> tuple[FloatArray, FloatArray]:
    """Return slopes, (m, end * n), and values of the outputs that can reach the allowed deviation.

    Both are relative to it.
    """
    # a box within the allowed ball: its corners touch it
    each = USED * allowed / np.sqrt(move.outputs.shape[1])
    rows = move.slopes.reshape(move.share.size, -1).T / each
    now = move.outputs.reshape(-1) / each
    reached = np.abs(now) + reach * np.abs(rows).sum(axis=1) > 1  # others cannot reach it
    return rows[reached], now[reached]


def _limited(
    move: LinearizedMoves, route: Route, limits: Limits, step: float
) -> list[tuple[Any, FloatArray]]:
    """Return matrices from changes to the used fractions of all limits, and the present use."""
    uses = []
    columns = move.share.shape[1]
    gone, slopes = route.along(move.share) - route.start, route.slopes(move.share[:, 0])
    for _, order, limit in limits.derivatives():
        own = [int(one) for one in route.moving if np.isfinite(limit[one])]
        for one in route.binding(limit) if columns == 1 else own:
            most = limit[one] * step**order
            whole = float(route.goal[one] - route.start[one])
            matrix, current = _differences(gone[:, one], whole, order)
            column = 0 if columns == 1 else int(np.searchsorted(route.moving, one))
            scaled = matrix * (slopes[:, one] / most)
            uses.append((scaled @ move.column(column), current / most))
    return uses


def _jerks(move: LinearizedMoves) -> tuple[Any, FloatArray]:
    """Return the matrix from changes to all jerks of shares, relative, and the present ones."""
    matrices, present = [], []
    for index, share in enumerate(move.share.T):
        matrix, current = _differences(share, 1.0, 3)
        scale = np.abs(current).max() or 1.0
        matrices.append([matrix @ move.column(index) / scale])
        present.append(current / scale)
    return sparse.block_array(matrices), np.concatenate(present)


def _range_of_shares(
    route: Route, limits: Limits, columns: int
) -> tuple[FloatArray | float, FloatArray | float]:
    """Return the least and the largest shares at which coordinates are within their ranges."""
    if not route.straight:
        return 0.0, 1.0
    ends = (np.stack([limits.low, limits.high]) - route.start)[:, route.moving]
    least, most = np.sort(ends / (route.goal - route.start)[route.moving], axis=0)
    return (float(least.max()), float(most.min())) if columns == 1 else (least, most)


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


REACHES = (0.1, 0.02, 0.005, 0.002, 0.001)
"""Largest changes of a share of the route, one for each round of linearization; they fall, so that
the rounds converge."""

REACHES_ALONG_CURVES = (0.03, 0.02, 0.01, 0.005, 0.002)
"""The same for curves, along which limits are linearized too."""

PROBE = 1e-4
"""Step of the forward differences of responses, as a share of the route."""

HOPELESS = 1.0
"""A duration is given up if its linear program exceeds the allowed value by this fraction."""

MOST_OWN = 720
"""Largest number of shares if each coordinate has its own time law: larger programs take
minutes, and a long move gains little."""

AT_ONCE = 250
"""Number of probes evaluated together: their sequences fit into memory."""


@dataclass(frozen=True, eq=False)
class PlannedMove:
    """A PlannedMove ends at a sample.

    Attributes:
        motion: coordinates, (count, n_coordinates).
        end: the sample from which on it stays at the goal.
        largest: largest deviation from rest after it, as predicted, in the outputs' unit.
    """

    motion: FloatArray
    end: int
    largest: float


def shape(
    response: Response,
    limits: Limits,
    start: FloatArray,
    end: int,
    allowed: float,
    own: bool = False,
) -> PlannedMove | None:
    """Shape a motion so that its residual is below the allowed value; return the best.

    It is None if no round found a motion that keeps the limits.

    Args:
        response: predicts motions.
        limits: limits of the result.
        start: shares of the route to begin with, (count,).
        end: sample from which on the result stays at the goal.
        allowed: deviation of the outputs from rest, in their unit, as a norm.
        own: whether each coordinate has its own time law, on a straight route and with at most
            ``MOST_OWN`` shares.
    """
    if end == 0:  # the motion jumps: nothing is free
        return None
    route, share = response.route, np.where(np.arange(response.count) < end, start, 1.0)[:, None]
    if own and route.straight and end * len(route.moving) <= MOST_OWN:
        share = np.tile(share, len(route.moving))
    best: PlannedMove | None = None
    for reach in REACHES if route.straight else REACHES_ALONG_CURVES:
        linearized = _linearized(response, share, end)
        solved = change(linearized, route, limits, response.step, allowed, reach)
        if solved is None:
            break
        changes, excess = solved
        share[:end] += changes
        motion = route.along(share)
        after = np.linalg.norm(response.outputs(motion[None])[0, end:], axis=1)
        planned = PlannedMove(motion, end, float(after.max()))
        kept = limits.kept(response.start, motion, response.step)
        if kept and (best is None or planned.largest < best.largest):
            best = planned
        if (best is not None and best.largest <= allowed) or excess > HOPELESS:
            break
    return best


def _linearized(response: Response, share: FloatArray, end: int) -> LinearizedMoves:
    """Return the outputs after the end, and their slopes by the shares before it."""
    after, columns = response.outputs(response.route.along(share)[None])[0, end:], share.shape[1]
    slopes = np.empty((end * columns, *after.shape))
    for some in batches(len(slopes), AT_ONCE):
        probes = np.tile(share, (len(slopes[some]), 1, 1))
        sample, column = np.divmod(np.arange(len(slopes))[some], columns)
        probes[np.arange(len(probes)), sample, column] += PROBE
        slopes[some] = response.outputs(response.route.along(probes))[:, end:] - after
    return LinearizedMoves(share[:end].copy(), after, slopes / PROBE)
