"""A move goes from rest to rest; it has its prediction and its margin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.motion.costs import Cost, MoveResponses, largest, residual, settled
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import judge
from slide_fmu.apps.motion.response import Response
from slide_fmu.core.signals import FloatArray


@dataclass(frozen=True, kw_only=True)
class MoveFigures:
    """MoveFigures are the times and distances of a move, for JSON files.

    Times are None if a move has not settled at the end of its sequence. Distances from rest, in
    the outputs' unit, are largest ones: after the move (residual), and at any time.
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
    """A Move is a motion from the start to the goal of a response.

    Attributes:
        name: for people, such as ``"ZV on 1 mode"``.
        motion: its coordinates, (count, n_coordinates).
        end: the sample from which on it stays at the goal.
        outputs: predicted, relative to rest at the goal, (count, n_outputs).
        margin: largest expected error, as a norm, (count,).
        known: share of the samples that the surrogate knows, of the move and of the response
            after it (``Reliability``).
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
        """Return a cost of the move, with its margin or as predicted.

        Args:
            cost: for example ``slide_fmu.apps.motion.costs.settled``.
            response: the response of the move.
            tolerance: largest distance from rest that counts as settled, in the outputs' unit.
            with_margin: whether the margin counts.
        """
        margin = self.margin if with_margin else np.zeros_like(self.margin)
        ends, time = np.array([self.end]), response.output_time
        responses = MoveResponses(self.outputs[None], margin[None], ends, time, tolerance)
        return float(cost(responses)[0])

    def trusted(self, cost: Cost, response: Response, tolerance: float) -> float:
        """Return a cost with the margin, as ``cost``; infinite if the move leaves the domain."""
        return self.cost(cost, response, tolerance) if self.known == 1 else np.inf

    def figures(self, response: Response, limits: Limits, tolerance: float) -> MoveFigures:
        """Return the figures of the move.

        Args:
            response: the response of the move.
            limits: limits of the task.
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
    """Return None in place of infinity: the motion has not settled within its sequence."""
    return cost if np.isfinite(cost) else None


def described(response: Response, name: str, motion: FloatArray, end: int) -> Move:
    """Evaluate a motion, (count, n_coordinates), that ends at a sample."""
    return described_all(response, [(name, motion, end)])[0]


def described_all(response: Response, named: Sequence[tuple[str, FloatArray, int]]) -> list[Move]:
    """Evaluate motions, each with its name and the sample at which it ends.

    A response with a reference model gives its outputs, without margin and domain.
    """
    if response.reference is not None:
        truths = [response.truth(motion) for _, motion, _ in named]
        none = np.zeros(response.count)
        return [Move(*one, truth, none, 1.0) for one, truth in zip(named, truths, strict=True)]
    motions, lead = np.stack([motion for _, motion, _ in named]), response.lead
    outputs = response.outputs(motions)
    judged = judge(response.surrogate, response.inputs(motions), response.margins)
    return [
        Move(
            name,
            motion,
            end,
            outputs[i],
            judged[i].margins[lead:],
            float(np.mean(judged[i].known[lead:])),
        )
        for i, (name, motion, end) in enumerate(named)
    ]
