"""A move from rest to rest with all that is known of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.motion.costs import Answers, Cost, largest, residual, settled
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import judge
from slide_fmu.apps.motion.response import Response
from slide_fmu.core.signals import FloatArray


@dataclass(frozen=True, kw_only=True)
class MoveFigures:
    """This is what a move takes and leaves, as JSON files hold it.

    Times are None of a move that has not settled at the end of its record. Distances from rest,
    in the outputs' unit, are largest ones: after the move (residual), and at any time.
    """

    name: str
    arrives_s: float
    settled_s: float | None
    settled_with_margin_s: float | None
    residual: float
    residual_with_margin: float
    largest: float
    known: float
    limits_used: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Move:
    """A Move is one way from the start to the goal of a response.

    Attributes:
        name: for people, such as ``"ZV on 1 mode"``.
        motion: its coordinates, (count, n_coordinates).
        end: the sample from which on it stays at the goal.
        outputs: predicted, about rest at the goal, (count, n_outputs).
        margin: how far off they may be, as a norm, (count,).
        known: share of the samples until the end that are in the surrogate's domain; without an
            error bound, in the ranges of its inputs.
    """

    name: str
    motion: FloatArray
    end: int
    outputs: FloatArray
    margin: FloatArray
    known: float

    def cost(
        self, cost: Cost, response: Response, tolerance: float, with_margin: bool = True
    ) -> float:
        """Give a cost of the move, with its margin or as predicted.

        Args:
            cost: as ``slide_fmu.apps.motion.costs.settled``.
            response: the move's.
            tolerance: largest distance from rest that counts as settled, in the outputs' unit.
            with_margin: whether the margin counts.
        """
        margin = self.margin if with_margin else np.zeros_like(self.margin)
        ends, time = np.array([self.end]), response.output_time
        told = Answers(self.outputs[None], margin[None], ends, time, tolerance)
        return float(cost(told)[0])

    def trusted(self, cost: Cost, response: Response, tolerance: float) -> float:
        """Give a cost with the margin, as ``cost``; infinite for a move that leaves the domain."""
        return self.cost(cost, response, tolerance) if self.known == 1 else np.inf

    def figures(self, response: Response, limits: Limits, tolerance: float) -> MoveFigures:
        """Return what the move takes and leaves.

        Args:
            response: the move's.
            limits: of the task.
            tolerance: largest distance from rest that counts as settled, in the outputs' unit.
        """
        used = limits.used(response.start, self.motion, response.step)
        if not response.route.straight:
            used["via_tolerance"] = response.missed(self.motion)
        return MoveFigures(
            name=self.name,
            arrives_s=float(response.time[self.end]),
            settled_s=_finite(self.cost(settled, response, tolerance, False)),
            settled_with_margin_s=_finite(self.cost(settled, response, tolerance)),
            residual=self.cost(residual, response, tolerance, False),
            residual_with_margin=self.cost(residual, response, tolerance),
            largest=self.cost(largest, response, tolerance, False),
            known=self.known,
            limits_used=used,
        )


def _finite(cost: float) -> float | None:
    """None stands for a motion that has not settled at the end of its record."""
    return cost if np.isfinite(cost) else None


def described(response: Response, name: str, motion: FloatArray, end: int) -> Move:
    """Evaluate a motion, (count, n_coordinates), that ends at a sample."""
    return described_all(response, [(name, motion, end)])[0]


def described_all(response: Response, named: Sequence[tuple[str, FloatArray, int]]) -> list[Move]:
    """Evaluate motions, each with a name before and the sample behind at which it ends."""
    motions, lead = np.stack([motion for _, motion, _ in named]), response.lead
    outputs = response.outputs(motions)
    judged = judge(response.surrogate, response.record(motions))
    return [
        Move(
            name,
            motion,
            end,
            outputs[i],
            judged[i].margins[lead:],
            float(np.mean(judged[i].known[lead : lead + end + 1])),
        )
        for i, (name, motion, end) in enumerate(named)
    ]
