"""The explicit Runge-Kutta methods of scipy, for steps that are short and many.

A sample step of a model is most often one step of the solver. There, what scipy does around the
method takes as long as the method itself: checks of arguments, and calls that hand on calls.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from slide_fmu.core.signals import FloatArray

SAFETY, LEAST_FACTOR, MOST_FACTOR = 0.9, 0.2, 10.0
"""How a step changes after its error is known, as in ``scipy.integrate``."""
LEAST_TOLERANCE = 100 * float(np.finfo(np.float64).eps)
"""Smallest relative tolerance, as in ``scipy.integrate``: below it rounding decides."""


@dataclass(frozen=True, eq=False)
class Tableau:
    """A Tableau has the coefficients of an explicit method with s stages.

    Attributes:
        times: c of the stages after the first, in steps.
        stages: rows a of these stages, of 1 .. s - 1 numbers.
        result: b of the result, (s,).
        errors: weights of the rates, those at the end of the step last, in error estimates, shape
            (s + 1,) each: one estimate, or those of fifth and third order of DOP853.
        exponent: power of an error in the factor of the next step.
    """

    times: tuple[float, ...]
    stages: tuple[FloatArray, ...]
    result: FloatArray
    errors: tuple[FloatArray, ...]
    exponent: float

    @cached_property
    def uses_last_rates(self) -> bool:
        """Whether the error depends on the rates at the end of the step."""
        return any(row[-1] != 0.0 for row in self.errors)

    def error(self, rates: FloatArray, scale: FloatArray, step: float) -> float:
        """Return the error of a step in parts of what is allowed, of rates (s + 1, n)."""
        squares = [float(found @ found) for found in (row @ rates / scale for row in self.errors)]
        if len(squares) == 1:
            return step * math.sqrt(squares[0] / len(scale))
        fifth, third = squares
        if fifth == 0.0 and third == 0.0:
            return 0.0
        return step * fifth / math.sqrt((fifth + 0.01 * third) * len(scale))


@cache
def tableau(method: str) -> Tableau:
    """Return the coefficients that scipy has for RK23, RK45 or DOP853."""
    import scipy.integrate

    found = getattr(scipy.integrate, method)
    count = found.n_stages
    return Tableau(
        times=tuple(float(time) for time in found.C[1:count]),
        stages=tuple(np.array(row[:s]) for s, row in enumerate(found.A[:count]) if s),
        result=np.array(found.B),
        errors=(found.E5, found.E3) if method == "DOP853" else (found.E,),
        exponent=-1.0 / (found.error_estimator_order + 1),
    )


def integrate(
    method: str,
    rates: Callable[[float, FloatArray], FloatArray],
    state: FloatArray,
    duration: float,
    tolerances: tuple[float, float],
    most_steps: int,
) -> tuple[FloatArray, float, str]:
    """Integrate x' = rates(t, x), (n,), from 0 s to a duration in s; the first step is all of it.

    Args:
        method: RK23, RK45 or DOP853.
        rates: gives x' at a time in s and a state; a step where they are not finite is repeated
            with a shorter one.
        state: where it begins, shape (n,).
        tolerances: relative and absolute one of every step.
        most_steps: number of steps after which it gives up.

    Returns:
        The state, and the time that it was reached at; why it gave up, or nothing.
    """
    of, (rtol, atol) = tableau(method), tolerances
    count, rtol = len(of.result), max(rtol, LEAST_TOLERANCE)
    k = np.zeros((count + 1, len(state)))
    k[0] = rates(0.0, state)
    time, step, uses_last = 0.0, duration, of.uses_last_rates
    for _ in range(most_steps):
        shortest, rejected = 10.0 * math.ulp(time), False
        step = max(step, shortest)
        while True:
            if step < shortest:
                return state, time, "the step became shorter than numbers can show"
            end = min(time + step, duration)
            step = end - time
            for s, (part, row) in enumerate(zip(of.times, of.stages, strict=True), start=1):
                k[s] = rates(time + part * step, state + step * (row @ k[:s]))
            reached = state + step * (of.result @ k[:count])
            if uses_last or end < duration:
                k[count] = rates(end, reached)
            scale = atol + rtol * np.maximum(np.abs(state), np.abs(reached))
            error = of.error(k, scale, step)
            if error < 1.0:
                break
            # what is not finite is no error below 1 either, and shortens a step most
            shrunk = SAFETY * error**of.exponent
            step *= shrunk if shrunk > LEAST_FACTOR else LEAST_FACTOR
            rejected = True
        time, state = end, reached
        if time >= duration:
            return state, time, ""
        grown = MOST_FACTOR if error == 0.0 else min(MOST_FACTOR, SAFETY * error**of.exponent)
        step *= min(1.0, grown) if rejected else grown
        k[0] = k[count]
    return state, time, f"more than {most_steps} steps"
