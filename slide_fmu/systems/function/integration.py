"""The solvers of scipy integrate ordinary differential equations over one sample step."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.errors import LoadError, SimulationError

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
        import scipy.integrate

        method = getattr(scipy.integrate, self.method)
        # trial steps may go too far; what is left of that in the end is reported
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.filterwarnings("ignore", module=r"scipy\.integrate")
            tolerances = {"rtol": self.rtol, "atol": self.atol, "first_step": duration}
            solver = method(rates, 0.0, state, duration, **tolerances)
            for _ in range(MOST_STEPS):
                try:
                    message = solver.step()
                except (ValueError, np.linalg.LinAlgError) as error:  # of numbers not finite
                    message = str(error)
                    break
                if solver.status != "running":
                    break
        if solver.status == "finished" and np.isfinite(solver.y).all():
            return np.array(solver.y)
        if solver.status == "running" and not message:
            message = f"more than {MOST_STEPS} steps"
        raise SimulationError(
            f"{self.method} gives up {solver.t:.6g} s after the sample: {message or 'not finite'}"
        )
