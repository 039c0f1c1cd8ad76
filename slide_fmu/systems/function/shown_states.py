"""States of a function system are shown as outputs, those alone on which its outputs depend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.function.lane_trial import Points
from slide_fmu.systems.function.user_function import UserFunction

CHANGES = 1e-12
"""A number depends on a state if another value of the state changes it by more than this part of
its largest value."""


@final
@dataclass(frozen=True, eq=False)
class FollowedByStates:
    """It gives what the function g of a user gives, and then some of the states.

    Attributes:
        g: the function of the outputs.
        states: numbers of the states, from 0.
    """

    g: UserFunction
    states: Sequence[int]

    def __call__(self, x: FloatArray, u: FloatArray, p: object, du: FloatArray) -> list[Any]:
        """Give the numbers for states (n,), or arrays of them for (n, B)."""
        result = self.g.bare(x, u, p, du)
        if self.g.count == 1 and np.shape(result) == x.shape[1:]:
            result = [result]
        return [*result, *(x[k] for k in self.states)]


def acting_states(f: UserFunction, g: UserFunction, points: Points) -> list[int]:
    """Return the numbers of the states on which outputs depend, directly or by other states.

    Each state has the values of other points in turn, since a stop or a play acts in a part of
    its range alone. What a function does not give numbers for is left out.
    """
    rates, outputs = points.alone(f), points.alone(g)
    count = len(points.x)
    acts_on, shows = np.zeros((count, count), dtype=bool), np.zeros(count, dtype=bool)
    for k in range(count):
        x = points.x.copy()
        x[k] = np.roll(x[k], 1)
        moved = replace(points, x=x)
        acts_on[k] = _changed(rates, moved.alone(f))
        shows[k] = _changed(outputs, moved.alone(g)).any()
    np.fill_diagonal(acts_on, False)
    acting = shows
    for _ in range(count):
        acting = acting | (acts_on & acting).any(axis=1)
    return [int(k) for k in np.flatnonzero(acting)]


def _changed(before: FloatArray, after: FloatArray) -> FloatArray:
    """Tell which numbers, (count, B), have changed at some point, as (count,)."""
    known = np.isfinite(before) & np.isfinite(after)
    sizes = np.max(np.abs(before), axis=1, initial=0.0, where=known)
    change = np.max(np.abs(after - before), axis=1, initial=0.0, where=known)
    return np.asarray(change > CHANGES * sizes)
