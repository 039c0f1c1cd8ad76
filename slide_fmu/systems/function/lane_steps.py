"""Explicit methods integrate many states at once, each with a step of its own.

The formulas are those of ``integration.by_explicit_method``. All sums go row by row over arrays
whose rows are whole vectors of the processor, since numbers of lanes are multiples of a ``WIDTH``.
So what is computed for one lane does not depend on the others, nor on their number, to the last
bit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.function.integration import (
    LEAST_FACTOR,
    LEAST_TOLERANCE,
    MOST_FACTOR,
    SAFETY,
    Solver,
    Tableau,
    tableau,
)

LaneRates = Callable[[int, FloatArray, FloatArray], None]
"""Writes x' of all lanes, (n, B), at a stage of the step and its states, (n, B)."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A step that was tried in every lane.

    Attributes:
        reached: states at its end, (n, B).
        errors: in parts of what is allowed, (B,); it is not below 1 where the step is refused.
    """

    reached: FloatArray
    errors: FloatArray


@final
class LaneSteps:
    """LaneSteps try steps of an explicit method in B lanes at once.

    Attributes:
        times: parts of the step at which rates are asked for, (stages,).
        uses_last: whether errors need the rates at the end of the step, which then are those of
            the last stage.
    """

    def __init__(self, solver: Solver) -> None:
        self._of: Tableau = tableau(solver.method)
        self._rtol, self._atol = max(solver.rtol, LEAST_TOLERANCE), solver.atol
        self.uses_last = self._of.uses_last_rates
        self.times = np.array([0.0, *self._of.times, *([1.0] if self.uses_last else [])])
        self._errors = [row[: len(self.times)] for row in self._of.errors]
        self._k = np.empty((0, 0, 0))

    def try_steps(self, rates: LaneRates, states: FloatArray, steps: FloatArray) -> Tried:
        """Try a step from states, (n, B), of lengths in s, (B,)."""
        stages = len(self._of.result)
        if self._k.shape[1:] != states.shape:
            self._k = np.zeros((len(self.times), *states.shape))
        k = self._k
        rates(0, states, k[0])
        for s, row in enumerate(self._of.stages, start=1):
            rates(s, self._moved(states, steps, row), k[s])
        reached = self._moved(states, steps, self._of.result)
        if self.uses_last:
            rates(stages, reached, k[stages])
        scale = self._atol + self._rtol * np.maximum(np.abs(states), np.abs(reached))
        return Tried(reached, self._error(scale, steps))

    def _moved(self, states: FloatArray, steps: FloatArray, weights: FloatArray) -> FloatArray:
        moved = self._weighted(weights)
        moved *= steps
        moved += states
        return moved

    def _weighted(self, weights: FloatArray) -> FloatArray:
        """Sum the first rates with weights, (s,); numpy adds one row after the other here."""
        total: FloatArray = np.einsum("s,snb->nb", weights, self._k[: len(weights)])
        return total

    def _error(self, scale: FloatArray, steps: FloatArray) -> FloatArray:
        squares = [
            np.add.reduce((self._weighted(row) / scale) ** 2, axis=0) for row in self._errors
        ]
        count = len(scale)
        if len(squares) == 1:
            return np.asarray(steps * np.sqrt(squares[0] / count))
        fifth, third = squares
        none = (fifth == 0.0) & (third == 0.0)
        return np.where(none, 0.0, steps * fifth / np.sqrt((fifth + 0.01 * third) * count))

    def next_steps(
        self,
        steps: FloatArray,
        errors: FloatArray,
        accepted: NDArray[np.bool_],
        rejected: NDArray[np.bool_],
    ) -> FloatArray:
        """Give the lengths of the next steps in s, (B,).

        Args:
            steps, errors: lengths and errors of the steps that were tried.
            accepted: which of them were good enough.
            rejected: which lanes had tried longer steps before at the same time.
        """
        factors = SAFETY * errors**self._of.exponent
        grown = np.where(errors == 0.0, MOST_FACTOR, np.minimum(MOST_FACTOR, factors))
        grown = np.where(rejected, np.minimum(1.0, grown), grown)
        shrunk = np.where(factors > LEAST_FACTOR, factors, LEAST_FACTOR)  # NaN is not
        return np.asarray(steps * np.where(accepted, grown, shrunk))
