"""A motion of a given duration with an allowed residual is found by linear programs.

The route is free at every sample. All coordinates share it, or each one has its own time law. A
linear program keeps the limits, keeps the linearized response after the end below the allowed
value, and uses no more jerk than that needs; without the last condition an optimiser exploits the
surrogate's errors. The response is linearized again about each result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.program import LinearizedMoves, change
from slide_fmu.apps.motion.response import Response
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.base import batches

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
    response: Response,
    limits: Limits,
    start: FloatArray,
    end: int,
    allowed: float,
    own: bool = False,
) -> Planned | None:
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
    best: Planned | None = None
    for reach in REACHES if route.straight else REACHES_ALONG_CURVES:
        linearized = _linearized(response, share, end)
        solved = change(linearized, route, limits, response.step, allowed, reach)
        if solved is None:
            break
        changes, excess = solved
        share[:end] += changes
        motion = route.along(share)
        after = np.linalg.norm(response.outputs(motion[None])[0, end:], axis=1)
        found = Planned(motion, end, float(after.max()))
        kept = limits.kept(response.start, motion, response.step)
        if kept and (best is None or found.largest < best.largest):
            best = found
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
