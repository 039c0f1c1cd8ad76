"""Costs of moves measure the vibration that they leave; the smallest cost is best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray


@dataclass(frozen=True, eq=False)
class MoveResponses:
    """MoveResponses are the predictions for B candidates, from which a cost is computed.

    Attributes:
        outputs: predicted, relative to rest at the goal, (B, count, n_outputs).
        margin: largest error of the prediction, as a norm, (B, count); zero in the first round.
        ends: samples from which on each stays at the goal, (B,).
        time: times of the outputs, in s, (count,).
        tolerance: distance from rest that counts as settled.
    """

    outputs: FloatArray
    margin: FloatArray
    ends: NDArray[np.intp]
    time: FloatArray
    tolerance: float

    @property
    def away(self) -> FloatArray:
        """The distance from rest, with its margin, as a norm over the outputs, (B, count)."""
        return np.asarray(np.linalg.norm(self.outputs, axis=2) + self.margin)


Cost = Callable[[MoveResponses], FloatArray]
"""Maps responses to a cost of each candidate, (B,); the smallest is best."""


def settled(responses: MoveResponses) -> FloatArray:
    """Return the time in s after which a move stays within the tolerance; infinite if never."""
    away = responses.away
    rows = np.arange(away.shape[1])
    outside = (away > responses.tolerance) | (rows < responses.ends[:, None])
    last = len(rows) - 1 - np.argmax(outside[:, ::-1], axis=1)
    # the first sample after the last one outside, unless that is the last of all
    times = np.append(responses.time, np.inf)
    return np.asarray(np.where(outside.any(axis=1), times[last + 1], responses.time[0]))


def residual(responses: MoveResponses) -> FloatArray:
    """Return the largest distance from rest after a move."""
    away = responses.away
    after = np.arange(away.shape[1]) >= responses.ends[:, None]
    return np.asarray(np.where(after, away, 0.0).max(axis=1))


def largest(responses: MoveResponses) -> FloatArray:
    """Return the largest distance from rest at the goal over the whole motion."""
    away = responses.away
    return np.asarray(away.max(axis=1))


COSTS: dict[str, Cost] = {"settled": settled, "residual": residual, "largest": largest}
"""Costs by their names in tasks."""
