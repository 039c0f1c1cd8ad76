"""Methods of scipy integrate ordinary differential equations over one sample step.

A sample step of a model is most often one step of the solver. There, what scipy does around an
explicit Runge-Kutta method takes as long as the method itself: checks of arguments, and calls that
hand on calls. So these methods are written here, with scipy's coefficients.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.errors import LoadError, SimulationError

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
        squares = [
            float(weighted @ weighted) for weighted in (row @ rates / scale for row in self.errors)
        ]
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

    method_class = getattr(scipy.integrate, method)
    count = method_class.n_stages
    return Tableau(
        times=tuple(float(time) for time in method_class.C[1:count]),
        stages=tuple(np.array(row[:s]) for s, row in enumerate(method_class.A[:count]) if s),
        result=np.array(method_class.B),
        errors=(method_class.E5, method_class.E3) if method == "DOP853" else (method_class.E,),
        exponent=-1.0 / (method_class.error_estimator_order + 1),
    )


def by_explicit_method(
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


METHODS = ("RK23", "RK45", "DOP853", "LSODA", "Radau", "BDF")
"""Methods by the names that ``scipy.integrate.solve_ivp`` has for them."""
EXPLICIT = METHODS[:3]
"""Those of them that take many short steps where a system is stiff."""
MOST_STEPS = 2_000
"""An interval that needs more steps than this is given up."""

Rates = Callable[[float, FloatArray], FloatArray]
"""Gives x' at a time in s from the beginning of the interval and a state, both (n,)."""


@dataclass(frozen=True)
class Solver:
    """A Solver says how x' = f is integrated: by which method of scipy, and how accurately.

    Attributes:
        method: one of those of ``scipy.integrate.solve_ivp``: ``"RK45"`` and ``"DOP853"`` for most
            systems, ``"LSODA"``, ``"Radau"`` or ``"BDF"`` for stiff ones.
        rtol, atol: relative and absolute tolerance of every solver step; ``atol`` is in the units
            of the states, so states far below 1 need a smaller one.

    Raises:
        LoadError: there is no such method, or a tolerance is not positive.
    """

    method: str = "DOP853"
    rtol: float = 1e-6
    atol: float = 1e-9

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise LoadError(f"method = {self.method!r}; expected one of {list(METHODS)}")
        for name in ("rtol", "atol"):
            value = getattr(self, name)
            if not (isinstance(value, float | int) and 0 < value < math.inf):
                raise LoadError(f"{name} = {shown(value)}; expected a positive number")

    def integrate(self, rates: Rates, state: FloatArray, duration: float) -> FloatArray:
        """Integrate from a state, shape (n,), over a duration in s, and give the state there.

        The first attempt is one step over the whole duration, whatever was integrated before: the
        result depends on the arguments alone.

        Raises:
            SimulationError: the solver gave up; the message says why.
        """
        method = by_explicit_method if self.method in EXPLICIT else _by_scipy
        # trial steps may go too far; what is left of that in the end is reported
        with np.errstate(all="ignore"):
            reached, time, problem = method(
                self.method, rates, state, duration, (self.rtol, self.atol), MOST_STEPS
            )
        if not problem and np.isfinite(reached).all():
            return reached
        raise SimulationError(
            f"{self.method} gives up {time:.6g} s after the sample: {problem or 'not finite'}"
        )


def _by_scipy(
    method: str,
    rates: Rates,
    state: FloatArray,
    duration: float,
    tolerances: tuple[float, float],
    most_steps: int,
) -> tuple[FloatArray, float, str]:
    """Integrate as ``by_explicit_method`` does, by an implicit method of scipy."""
    import scipy.integrate

    rtol, atol = tolerances
    options = {"rtol": rtol, "atol": atol, "first_step": duration}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"scipy\.integrate")
        solver = getattr(scipy.integrate, method)(rates, 0.0, state, duration, **options)
        for _ in range(most_steps):
            try:
                problem = solver.step()
            except (ValueError, np.linalg.LinAlgError) as error:  # of numbers not finite
                return solver.y, solver.t, str(error)
            if solver.status == "finished":
                return np.array(solver.y), solver.t, ""
            if solver.status == "failed":
                return solver.y, solver.t, problem or "not finite"
    return solver.y, solver.t, f"more than {most_steps} steps"
