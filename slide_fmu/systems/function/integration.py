"""Methods of scipy integrate ordinary differential equations over one sample step."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.function import explicit

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
                raise LoadError(f"{name} = {value!r}; expected a positive number")

    def integrate(self, rates: Rates, state: FloatArray, duration: float) -> FloatArray:
        """Integrate from a state, shape (n,), over a duration in s, and give the state there.

        The first attempt is one step over the whole duration, whatever was integrated before: the
        result depends on the arguments alone.

        Raises:
            SimulationError: the solver gave up; the message says why.
        """
        method = explicit.integrate if self.method in EXPLICIT else _by_scipy
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
    """Integrate as ``explicit.integrate`` does, by an implicit method of scipy."""
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
