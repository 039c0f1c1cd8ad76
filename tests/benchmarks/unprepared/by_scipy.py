"""True outputs of functions: scipy integrates them, piece by piece between jumps and bends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from tests.benchmarks.unprepared.kinds import Motion
from tests.benchmarks.unprepared.models import Model, Wanted

TOLERANCES = {"rtol": 1e-9, "atol": 1e-11}


@dataclass(frozen=True, eq=False)
class _Equations:
    """The equations of a function, for B motions at once: states (n, B), inputs (n_inputs, B).

    One motion alone has the shapes (n,) and (n_inputs,), which is quicker and suits any function.
    """

    module: Any
    parameters: SimpleNamespace
    order: list[int]

    def rates(self, states: FloatArray, inputs: FloatArray) -> FloatArray:
        rows = self.module.f(states, inputs, self.parameters)
        if states.ndim == 1:
            return np.array(rows, np.float64)
        return np.stack([np.broadcast_to(row, states.shape[1:]) for row in rows])

    def inputs(self, group: Sequence[Motion], time: float) -> FloatArray:
        rows = [motion(time)[0, self.order] for motion in group]
        return rows[0] if len(rows) == 1 else np.stack(rows, axis=1)

    def take_many(self) -> bool:
        """Whether there are no branches by values, which arrays of several motions cannot take."""
        states = np.outer(self.module.start, np.ones(2))
        try:
            self.rates(states, np.zeros((len(self.order), 2)))
        except ValueError:
            return False
        return True

    def rest(self, inputs: FloatArray) -> FloatArray:
        """Return the equilibrium under constant inputs (n_inputs,) that is reached from start."""
        from scipy.integrate import solve_ivp
        from scipy.optimize import fsolve

        def rates(_: float, x: FloatArray) -> FloatArray:
            return self.rates(x, inputs)

        x = np.array(self.module.start, np.float64)
        for span in (1.0, 10.0, 100.0):
            x = solve_ivp(rates, (0, span), x, method="LSODA", rtol=1e-9, atol=1e-12).y[:, -1]
            found, *_ = fsolve(lambda z: rates(0.0, z), x, xtol=1e-13, full_output=True)
            if np.abs(found - x).max() < 1e-3 * (1e-3 + np.abs(x).max()):
                return np.asarray(found)
        return x


def by_scipy(model: Model, wanted: Wanted, motions: Sequence[Motion]) -> list[FloatArray]:
    """Integrate a function; motions with the same breaks together, where arrays are taken."""
    module = model.module()
    wanted.require(module.inputs, module.outputs)
    order = [wanted.inputs.index(name) for name in module.inputs]
    equations = _Equations(module, SimpleNamespace(**module.parameters), order)
    together: dict[object, list[Motion]] = {}
    for motion in motions:
        key = motion.drawn.breaks.tobytes() if equations.take_many() else motion
        together.setdefault(key, []).append(motion)
    groups = list(together.values())
    columns = [list(module.outputs).index(name) for name in wanted.outputs]
    done = {}
    for group in groups:
        for motion, states in zip(group, _states(equations, group, wanted), strict=True):
            inputs = motion(wanted.times)[:, order].T
            rows = module.g(states.T, inputs, equations.parameters)
            done[motion] = np.stack(rows, axis=1)[:, columns]
    return [done[motion] for motion in motions]


def _states(equations: _Equations, group: Sequence[Motion], wanted: Wanted) -> FloatArray:
    """Return the states of motions with the same breaks, (motions, N, n)."""
    from scipy.integrate import solve_ivp

    times = wanted.times
    x = np.stack([equations.rest(equations.inputs([motion], 0.0)) for motion in group], axis=-1)
    x = x[:, 0] if len(group) == 1 else x
    states = np.empty((len(times), *x.shape))
    states[0] = x
    edges = np.concatenate([[0.0], group[0].drawn.breaks, times[-1:]])
    shape = x.shape
    for a, b in pairwise(edges):
        last = b - 1e-9 * (b - a)  # the inputs before a jump

        def rates(t: float, z: FloatArray, last: float = last) -> FloatArray:
            inputs = equations.inputs(group, min(t, last))
            return equations.rates(z.reshape(shape), inputs).ravel()

        inside = np.flatnonzero((times > a) & (times <= b))
        at = np.unique(np.append(times[inside], b))
        longest = 64 * wanted.step  # a burst after a rest is not stepped over
        found = solve_ivp(rates, (a, b), x.ravel(), "DOP853", at, max_step=longest, **TOLERANCES)
        if not found.success:
            raise RuntimeError(f"scipy stopped between {a:g} and {b:g} s: {found.message}")
        rows = found.y.T.reshape(-1, *shape)
        states[inside], x = rows[: len(inside)], rows[-1]
    return states.reshape(*states.shape[:2], len(group)).transpose(2, 0, 1)
