"""A function is integrated over whole motions by one call of scipy, as its user would do it.

It is for comparing times: between samples nothing stops the solver, and nothing is checked. What
becomes of an input that jumps depends on where the solver's steps happen to end.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.systems.base import State, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.equations import ModelEquations
from slide_fmu.systems.function.integration import Solver
from slide_fmu.systems.function.user_function import UserFunction

WHOLE = "solve_ivp over the whole motion"
"""What is said of such a solver, behind the name of its method."""

MOST_CALLS = 500
"""A solver that calls f more often than this in a sample, in the mean, is given up."""


@final
class WholeMotion(System):
    """A WholeMotion is a function system whose motions are each integrated by one call.

    It begins where the function system begins.
    """

    def __init__(
        self,
        of: System,
        equations: ModelEquations,
        g: UserFunction,
        rest_state: Callable[[FloatArray], State],
        solver: Solver,
    ) -> None:
        """Take a function system in parts: f, g and its start under a first input, (n_inputs,)."""
        self.inputs, self.outputs, self.step = of.inputs, of.outputs, of.step
        self.solved_by = f"{solver.method} ({WHOLE})"
        self._equations, self._g, self._rest_state, self._solver = equations, g, rest_state, solver
        self._starts: dict[bytes, FloatArray] = {}

    def simulate(self, inputs: FloatArray) -> FloatArray:
        """Integrate one motion; the start under a first input is looked for once."""
        import scipy.integrate

        start = self._start(inputs[0])
        count, ends = len(inputs), self.step * np.arange(len(inputs) + 1, dtype=np.float64)
        rates, outputs = self._functions(inputs)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of trial steps that go too far
            try:
                found = scipy.integrate.solve_ivp(
                    rates,
                    (0.0, ends[-1]),
                    start,
                    method=self._solver.method,
                    t_eval=ends,
                    rtol=self._solver.rtol,
                    atol=self._solver.atol,
                )
                if not found.success or found.y.shape[1] != count + 1:
                    raise SimulationError(f"{self.solved_by} gives up: {found.message}")
                return outputs(found.y)
            except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
                raise SimulationError(f"{self.solved_by} gives up: {error}") from error

    def _start(self, first: FloatArray) -> FloatArray:
        key = first.tobytes()
        if key not in self._starts:
            self._starts[key] = self._rest_state(first).coordinates
        return self._starts[key]

    def _functions(
        self, inputs: FloatArray
    ) -> tuple[
        Callable[[float, FloatArray], object],
        Callable[[FloatArray], FloatArray],
    ]:
        """Return x' of a time in s and a state, and the outputs of states (n, N + 1)."""
        moving = hold_of(self.inputs) == "first_order"
        begins = np.concatenate([inputs[:1], inputs[:-1]]) if moving else inputs
        slopes = (inputs - begins) / self.step
        f, g, p = self._equations.function.bare, self._g.bare, self._equations.p
        step, last, most = self.step, len(inputs) - 1, MOST_CALLS * (len(inputs) + 1)
        calls = 0

        def rates(time: float, x: FloatArray) -> object:
            nonlocal calls
            calls += 1
            if calls > most:
                raise SimulationError(f"{self.solved_by} gives up: more than {most} calls of f")
            k = min(int(time / step), last)
            if not moving:
                return f(x, begins[k], p, slopes[k])
            return f(x, begins[k] + (time - k * step) * slopes[k], p, slopes[k])

        def outputs(states: FloatArray) -> FloatArray:
            at, before = np.concatenate([inputs[:1], inputs]), np.zeros_like(inputs[:1])
            du = np.concatenate([before, slopes])
            return np.array(
                [g(x, u, p, rate) for x, u, rate in zip(states.T, at, du, strict=True)],
                dtype=np.float64,
            ).reshape(len(at), len(self.outputs))

        return rates, outputs
