"""This module integrates equations x' = f(x, u, p) over sample steps, and finds their rest.

Inputs that bend between two samples follow a polynomial through points in between.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import read_only
from slide_fmu.systems.declared import Parameters
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.equilibrium import Field, equilibrium
from slide_fmu.systems.function.integration import Solver
from slide_fmu.systems.function.user_function import FunctionError, UserFunction


@dataclass(frozen=True, eq=False)
class Bend:
    """A bend is the course of inputs that bend within a sample step: a polynomial.

    A solver that takes one step from sample to sample follows it at the cost of a straight line.

    Attributes:
        step: sample step h in s.
        exponents: of the powers of t / h, (parts + 1,).
        coefficients: of these powers, for the inputs and then for their rates in 1/s,
            (parts + 1, 2 n_inputs).
        low, high: what the inputs stay within, (n_inputs,).
    """

    step: float
    exponents: FloatArray
    coefficients: FloatArray
    low: FloatArray
    high: FloatArray

    @staticmethod
    def through(points: FloatArray, step: float, ends: FloatArray) -> Bend:
        """Return the bend through points that are equally far apart in time.

        Args:
            points: inputs at the beginning of the step and at the end of each of its parts, shape
                (parts + 1, n_inputs).
            step: sample step h in s.
            ends: ranges of the inputs, shape (2, n_inputs): points beyond make them wider.
        """
        exponents = np.arange(len(points), dtype=np.float64)
        powers = through(len(points) - 1) @ points
        slopes = np.roll(exponents[:, None] * powers, -1, axis=0) / step
        low, high = (
            np.minimum(ends[0], points.min(axis=0)),
            np.maximum(ends[1], points.max(axis=0)),
        )
        return Bend(step, exponents, np.hstack([powers, slopes]), low, high)

    def __call__(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Give the inputs and their rates, (n_inputs,) each, at a time in s from 0 to the step."""
        values = (time / self.step) ** self.exponents @ self.coefficients
        count = len(self.low)
        return np.minimum(np.maximum(values[:count], self.low), self.high), values[count:]


@cache
def through(degree: int) -> FloatArray:
    """Return what makes coefficients of the values at 0, 1 / degree .. 1, lowest power first.

    Its shape is (degree + 1, degree + 1).
    """
    at = np.linspace(0.0, 1.0, degree + 1)
    return np.asarray(np.linalg.inv(np.vander(at, increasing=True)))


SETTLING = (16, 48, 192, 768, 3072)
"""Further samples under the same input; an equilibrium is searched at the start and after each."""
LONG = Solver("LSODA", 1e-6)
"""Integrates until the system rests: its steps become long when little moves."""

NEAR_END = 0.99
"""After this part of a step, rounding might take an evenly moving input beyond its end."""

Course = Callable[[float], tuple[FloatArray, FloatArray]]
"""Gives the inputs and their rates, (n_inputs,) each, at a time in s after the sample."""


@dataclass(frozen=True, eq=False)
class ModelEquations:
    """ModelEquations are a function of the user with its parameters, integrated over sample steps.

    Attributes:
        function: f of (x, u, p) or (x, u, p, du).
        p: what the function finds its parameters in.
        step: sample step h in s.
        solver: how they are integrated.
    """

    function: UserFunction
    p: Parameters
    step: float
    solver: Solver

    def held(self, u: FloatArray) -> Field:
        """Give x' = f(x) under an input that is held, shape (n_inputs,)."""
        held, still = read_only(u), read_only(np.zeros_like(u))
        return lambda x: self.function(x, held, self.p, still)

    def after_step(self, state: FloatArray, last: FloatArray, reached: FloatArray) -> FloatArray:
        """Give the state (n,) one sample step later, under inputs that move evenly or are held.

        Args:
            state: where the step begins, shape (n,).
            last: the inputs there, shape (n_inputs,).
            reached: those at its end, which rounding does not exceed; the same if they are held.

        Raises:
            SimulationError: the solver gave up, or the function failed.
        """
        first, rate = read_only(last), read_only((reached - last) / self.step)
        moves, near = bool(rate.any()), NEAR_END * self.step
        low, high = np.minimum(last, reached), np.maximum(last, reached)

        def course(time: float) -> tuple[FloatArray, FloatArray]:
            u = first + time * rate if moves else first
            return np.minimum(np.maximum(u, low), high) if time > near else u, rate

        return self.after_course(state, course)

    def after_jumps(
        self, state: FloatArray, last: FloatArray, reached: FloatArray, at: FloatArray
    ) -> FloatArray:
        """Give the state (n,) one sample step later, under inputs of which some jump.

        The solver begins anew at every jump. Arguments are those of ``after_step``, and the part
        of the step after which each input jumps, NaN where it moves evenly, shape (n_inputs,).
        """
        jumps = ~np.isnan(at)
        rate = read_only(np.where(jumps, 0.0, (reached - last) / self.step))
        low, high = np.minimum(last, reached), np.maximum(last, reached)
        times = sorted({0.0, self.step, *(self.step * at[jumps]).tolist()})
        for begin, end in itertools.pairwise(times):
            first = np.where(self.step * at <= begin, reached, last)  # NaN is not

            def course(
                time: float, begin: float = begin, first: FloatArray = first
            ) -> tuple[FloatArray, FloatArray]:
                u = first + (begin + time) * rate
                return np.minimum(np.maximum(u, low), high), rate

            state = self.after_course(state, course, end - begin)
        return state

    def after_course(
        self, state: FloatArray, course: Course, duration: float | None = None
    ) -> FloatArray:
        """Give the state (n,) after a duration in s, under inputs that follow a course.

        The duration is one sample step if None.

        Raises:
            SimulationError: as of ``after_step``.
        """
        trouble: list[str] = []  # of the last step that was tried

        def rates(time: float, x: FloatArray) -> FloatArray:
            u, rate = course(time)
            try:
                values = self.function(x, u, self.p, rate)
            except FunctionError as error:
                # a step that is only tried may go where f is not defined: a shorter one follows
                if time == 0.0 or not isinstance(error.__cause__, ArithmeticError | ValueError):
                    raise
                trouble[:] = [f"{error}, {place(time, x, u)}"]
                return np.full(len(x), np.nan)
            if not math.isfinite(values.dot(values)) and np.isfinite(x).all():  # the first is fast
                trouble[:] = [f"f gave {values.tolist()}, {place(time, x, u)}"]
            return values

        def place(time: float, x: FloatArray, u: FloatArray) -> str:
            return f"{time:.6g} s after the sample with x = {x.tolist()}, u = {u.tolist()}"

        try:
            return self.solver.integrate(rates, state, self.step if duration is None else duration)
        except FunctionError:
            raise
        except SimulationError as error:
            raise SimulationError(
                f"{'; '.join([*trouble, str(error)])}; expected motions that stay finite: check "
                'f, take method = "LSODA" if it is stiff, and tanh(v / 1e-3) in place of sign(v)'
            ) from error

    def rest(self, start: FloatArray, u: FloatArray, sizes: FloatArray) -> FloatArray | None:
        """Give the stable equilibrium that is found from a start under an input that is held.

        It is looked for at the start itself, then where the system goes from there; None where it
        goes nowhere near one. The sizes are as of ``slide_fmu.systems.function.equilibrium``.
        """
        field, state = self.held(u), start
        try:
            at_rest = equilibrium(field, state, sizes)
            for samples in SETTLING:
                if at_rest is not None:
                    break
                state = LONG.integrate(lambda _, x: field(x), state, samples * self.step)
                at_rest = equilibrium(field, state, sizes)
        except SimulationError:  # it goes without end
            return None
        return at_rest

    def states_along(self, start: FloatArray, path: FloatArray) -> FloatArray:
        """Give the states along a path of inputs, (N, n_inputs), the start first, shape (K, n).

        There are N of them, or fewer where it cannot be followed to its end.
        """
        states = [start]
        for last, now in itertools.pairwise(path):
            try:
                states.append(self.after_step(states[-1], last, now))
            except SimulationError:  # then the states so far must do
                break
        return np.stack(states)
